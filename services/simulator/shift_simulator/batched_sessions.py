"""The partner's dynamics for many runs at once (MODEL.md, sections 1 and 5), as numpy arrays over runs.

Pure. It is the second writing of rules that the services' cores hold: a test runs both, event by event, and
compares every triple, action and reward. Awareness follows the last result (window 1), as in the paper's
simulation; another window is refused.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp

import numpy as np
from shift_model.vocabulary import AWARENESSES, GAZES
from shift_schemas.errors import InvalidSettings
from shift_study.study import CapacitySettings, RewardSettings, Study

from shift_simulator.batched_learners import BatchLearner
from shift_simulator.random_streams import Bools, Draws, Floats, Ints, drawn, index
from shift_simulator.users import ACTIONS, DEVIATION, DURATIONS, User, true_capacity

MARGIN = 1e-9
FOCUSED = GAZES.index("focused")
FAILURE = AWARENESSES.index("failure")
SUCCESS = AWARENESSES.index("success")


@dataclass(frozen=True)
class Trace:
    """What happened, each [episodes, runs]."""

    triple: Ints
    action: Ints
    reward: Floats

    @property
    def cumulative(self) -> Floats:
        """Cumulative reward after each episode, added up in order."""
        return np.cumsum(self.reward, axis=0)


def simulate(user: User, study: Study, learner: BatchLearner, seeds: Ints, episodes: int, copies: int = 1) -> Trace:
    """Sessions of ``episodes`` decisions with each seed (and ``copies`` of them side by side).

    Parameters
    ----------
    learner
        Fresh, for ``len(seeds) * copies`` runs.
    """
    draws = drawn(seeds, episodes, copies)
    partners = Partners(user, study, draws)
    shape = draws.task.shape
    trace = Trace(np.empty(shape, np.int64), np.empty(shape, np.int64), np.empty(shape))
    for episode in range(episodes):
        triple = partners.triple(episode)
        action = learner.decide(triple, draws.decision[episode])
        reward = partners.perform(episode, action)
        learner.learn(triple, action, reward)
        trace.triple[episode], trace.action[episode], trace.reward[episode] = triple, action, reward
    return trace


class Partners:
    """One simulated partner per run, and the capacity that the monitor believes it has."""

    def __init__(self, user: User, study: Study, draws: Draws) -> None:
        check_simulable(study)
        runs = draws.task.shape[1]
        self._user = user
        self._draws = draws
        self._task = index(draws.task, user.tasks)
        self._gaze = gaze_classes(draws, user.gaze.keep)
        self._rewards = rewards(study.reward)
        self._shown = Capacity(study.capacity, study, runs)
        true = true_capacity(user, study)
        self._true = self._shown if true == study.capacity else Capacity(true, study, runs)
        self._awareness = np.zeros((runs, user.tasks), np.int64)
        self._runs = np.arange(runs)

    def triple(self, episode: int) -> Ints:
        """Index of the monitoring state that the decider sees, int [runs]."""
        return self._index(self._shown, episode)

    def perform(self, episode: int, action: Ints) -> Floats:
        """The reward of each run's action; capacity and awareness move on."""
        success = self._succeeds(episode, action)
        d, n = self._draws, len(DURATIONS)
        reward: Floats = self._rewards[
            success.astype(np.int64), index(d.t_comprehension[episode], n), index(d.t_enabledness[episode], n)
        ]
        self._awareness[self._runs, self._task[episode]] = np.where(success, SUCCESS, FAILURE)
        self._shown.execute(action)
        if self._true is not self._shown:
            self._true.execute(action)
        return reward

    def _succeeds(self, episode: int, action: Ints) -> Bools:
        d = self._draws
        table = self._user.table_at(episode + 1)
        true = d.success[episode] < table[self._index(self._true, episode), action]
        success: Bools = np.where(d.deviates[episode] < DEVIATION, d.coin[episode] < 0.5, true)
        return success

    def _index(self, capacity: Capacity, episode: int) -> Ints:
        awareness = self._awareness[self._runs, self._task[episode]]
        triple: Ints = 15 * capacity.high + 5 * self._gaze[episode] + awareness
        return triple


class Capacity:
    """Processing capacity of each run (the paper's case equation)."""

    def __init__(self, settings: CapacitySettings, study: Study, runs: int) -> None:
        self._settings = settings
        self._cost = costs(settings, study)
        self._value = np.full(runs, settings.start)
        self._previous = np.full(runs, -1)

    @property
    def high(self) -> Ints:
        """Its class as an index: 1 at or above the threshold."""
        high: Ints = (self._value >= self._settings.threshold - MARGIN).astype(np.int64)
        return high

    def execute(self, action: Ints) -> None:
        """A repeated strategy recovers it, any other costs."""
        s = self._settings
        recovered = np.minimum(self._value + s.recovery, s.max)
        spent = np.maximum(self._value - self._cost[action], s.min)
        self._value = np.where(action == self._previous, recovered, spent)
        self._previous = action


def costs(settings: CapacitySettings, study: Study) -> Floats:
    """What each action costs, float [actions]: demanding where one of its levels is."""
    demanding = set(settings.demanding)
    return np.array(
        [settings.demanding_cost if demanding & set(a) else settings.other_cost for a in study.scoring.actions]
    )


def gaze_classes(draws: Draws, keep: float) -> Ints:
    """Gaze class per episode and run: focused first, then kept or drawn anew."""
    fresh = index(draws.gaze_class, len(GAZES))
    classes = np.empty_like(fresh)
    classes[0] = FOCUSED
    for episode in range(1, len(fresh)):
        classes[episode] = np.where(draws.gaze_kept[episode] < keep, classes[episode - 1], fresh[episode])
    return classes


def rewards(settings: RewardSettings) -> Floats:
    """Reward by success and both durations, float [2, 5, 5] (paper, section III-E), added up as the learner does."""
    table = np.empty((2, len(DURATIONS), len(DURATIONS)))
    for success, sign in enumerate((-1.0, 1.0)):
        for i, t in enumerate(DURATIONS):
            for j, u in enumerate(DURATIONS):
                values = sign * exp(-settings.decay * t), sign * exp(-settings.decay * u)
                table[success, i, j] = settings.scale * ((values[0] + values[1]) / 2)
    return table


def check_simulable(study: Study) -> None:
    """Raise :class:`InvalidSettings` for a study that users' tables cannot be looked up in."""
    if len(study.scoring.actions) != ACTIONS:
        raise InvalidSettings(f"simulated users know {ACTIONS} actions; the study has {len(study.scoring.actions)}")
    if study.awareness.window != 1 or study.awareness.threshold == 0:
        raise InvalidSettings("simulating many runs at once needs awareness.window 1 and awareness.threshold above 0")
