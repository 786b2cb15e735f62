"""Many simulated sessions at once (docs/model.md, sections 1 and 5), as numpy arrays over runs.

Pure. The equations are those of ``shift_model``, which the services' cores use too. A test runs both, event by
event, and compares every triple, action and reward. Awareness follows the last result (window 1), as in the
paper's simulation. A study with another window is refused.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from shift_model.capacity import is_high
from shift_model.reward import reward as reward_of
from shift_model.reward import task_performance
from shift_model.vocabulary import AWARENESSES, GAZES
from shift_schemas.errors import InvalidSettings
from shift_study.constants import CapacitySettings, RewardSettings
from shift_study.study import Study

from shift_simulator.batched_learners import BatchLearner
from shift_simulator.random_streams import Bools, Draws, Floats, Ints, draws_of, index
from shift_simulator.users import ACTIONS, DEVIATION, DURATIONS, User, true_capacity

FOCUSED = GAZES.index("focused")
FAILURE = AWARENESSES.index("failure")
SUCCESS = AWARENESSES.index("success")


@dataclass(frozen=True)
class Trace:
    """The record of the simulated sessions, each array [episodes, runs]."""

    triple: Ints
    action: Ints
    reward: Floats

    @property
    def cumulative(self) -> Floats:
        """Return the cumulative reward after each episode."""
        return np.cumsum(self.reward, axis=0)


OnProgress = Callable[[int, int], None]
"""Called now and then with how many steps of how many are done."""


def simulate(
    user: User,
    study: Study,
    learner: BatchLearner,
    seeds: Ints,
    episodes: int,
    copies: int = 1,
    on_progress: OnProgress | None = None,
) -> Trace:
    """Simulate a session of ``episodes`` decisions for each seed, ``copies`` times side by side.

    Parameters
    ----------
    learner
        A learner that has learned nothing yet, for ``len(seeds) * copies`` runs.
    """
    draws = draws_of(seeds, episodes, copies)
    persons = BatchedPersons(user, study, draws)
    shape = draws.task.shape
    trace = Trace(np.empty(shape, np.int64), np.empty(shape, np.int64), np.empty(shape))
    for episode in range(episodes):
        triple = persons.triple(episode)
        action = learner.decide(triple, draws.decision[episode])
        reward = persons.perform(episode, action)
        learner.learn(triple, action, reward)
        trace.triple[episode], trace.action[episode], trace.reward[episode] = triple, action, reward
        if on_progress is not None:
            on_progress(episode + 1, episodes)
    return trace


class BatchedPersons:
    """One simulated person for each run, and the capacity that the monitor estimates for each."""

    def __init__(self, user: User, study: Study, draws: Draws) -> None:
        check_simulable(study)
        runs = draws.task.shape[1]
        self._user = user
        self._draws = draws
        self._task = index(draws.task, user.tasks)
        self._gaze = gaze_classes(draws, user.gaze.keep)
        self._rewards = reward_table(study.reward)
        self._estimated = Capacities(study.capacity, study, runs)
        true = true_capacity(user, study)
        self._true = self._estimated if true == study.capacity else Capacities(true, study, runs)
        self._awareness = np.zeros((runs, user.tasks), np.int64)
        self._runs = np.arange(runs)

    def triple(self, episode: int) -> Ints:
        """Return the index of the monitoring state that the decider sees, int [runs]."""
        return self._index(self._estimated, episode)

    def perform(self, episode: int, action: Ints) -> Floats:
        """Return the reward of each run's action, and update capacity and awareness."""
        success = self._succeeds(episode, action)
        d, n = self._draws, len(DURATIONS)
        reward: Floats = self._rewards[
            success.astype(np.int64), index(d.t_comprehension[episode], n), index(d.t_enabledness[episode], n)
        ]
        self._awareness[self._runs, self._task[episode]] = np.where(success, SUCCESS, FAILURE)
        self._estimated.execute(action)
        if self._true is not self._estimated:
            self._true.execute(action)
        return reward

    def _succeeds(self, episode: int, action: Ints) -> Bools:
        d = self._draws
        table = self._user.table_at(episode + 1)
        true = d.success[episode] < table[self._index(self._true, episode), action]
        success: Bools = np.where(d.deviates[episode] < DEVIATION, d.coin[episode] < 0.5, true)
        return success

    def _index(self, capacity: Capacities, episode: int) -> Ints:
        awareness = self._awareness[self._runs, self._task[episode]]
        triple: Ints = 15 * capacity.high + 5 * self._gaze[episode] + awareness
        return triple


class Capacities:
    """The processing capacity of each run."""

    def __init__(self, settings: CapacitySettings, study: Study, runs: int) -> None:
        self._settings = settings
        self._cost = action_costs(settings, study)
        self._value = np.full(runs, settings.start)
        self._previous = np.full(runs, -1)

    @property
    def high(self) -> Ints:
        """Return the index of its class for each run: 1 is high, 0 is low."""
        return is_high(self._value, self._settings.threshold).astype(np.int64)

    def execute(self, action: Ints) -> None:
        """Update each run by the capacity equation after its action (an index)."""
        self._value = self._settings.after(self._value, action == self._previous, self._cost[action])
        self._previous = action


def action_costs(settings: CapacitySettings, study: Study) -> Floats:
    """Return the capacity that each action costs, float [actions]."""
    return np.array([settings.cost_of(levels) for levels in study.scoring.actions])


def gaze_classes(draws: Draws, keep: float) -> Ints:
    """Return the gaze class of each episode and run: focused at first, then kept or drawn again."""
    fresh = index(draws.gaze_class, len(GAZES))
    classes = np.empty_like(fresh)
    classes[0] = FOCUSED
    for episode in range(1, len(fresh)):
        classes[episode] = np.where(draws.gaze_kept[episode] < keep, classes[episode - 1], fresh[episode])
    return classes


def reward_table(settings: RewardSettings) -> Floats:
    """Return the reward by success and both durations, float [2, 5, 5] (paper, section III-E)."""
    success = np.array([False, True])[:, None]
    performance = task_performance(success, np.array(DURATIONS, np.float64)[None, :], settings.decay)
    return reward_of(performance[:, :, None], performance[:, None, :], settings.scale)


def check_actions(study: Study) -> None:
    """Raise :class:`InvalidSettings` unless the study has the actions of the simulated users."""
    if len(study.scoring.actions) != ACTIONS:
        raise InvalidSettings(f"simulated users have {ACTIONS} actions; the study has {len(study.scoring.actions)}")


def check_simulable(study: Study) -> None:
    """Raise :class:`InvalidSettings` for a study that the tables of simulated users do not fit."""
    check_actions(study)
    if study.awareness.window != 1 or study.awareness.threshold == 0:
        raise InvalidSettings("simulating many runs at once needs awareness.window 1 and awareness.threshold above 0")
