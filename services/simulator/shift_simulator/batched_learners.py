"""Learners for many runs at once.

Q-learning and scoring are written for arrays over runs. A test checks that they equal the learners of the services,
bit for bit. The planner has a batched form of its own. Any other learner runs as it is, one run after the other.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from shift_learner.learner import Context, DecisionView, Learner
from shift_learner.learners import learner_named
from shift_learner.learners.planning import engine
from shift_model.q_learning import decayed_epsilon, updated_value
from shift_model.random_numbers import pick

from shift_simulator.random_streams import Bools, Floats, Ints


class BatchLearner(Protocol):
    """A learner for many independent runs."""

    def decide(self, triple: Ints, u: Floats) -> Ints:
        """Return the action of each run, drawn with ``u`` (in [0, 1)) from its row at ``triple``; each is [runs]."""

    def learn(self, triple: Ints, action: Ints, reward: Floats) -> None:
        """Learn from the reward of the newest decision; each argument is [runs]."""


def batch_learner(context: Context, runs: int) -> BatchLearner:
    """Return the study's learner for ``runs`` runs."""
    settings = context.study.learner
    if settings.name == "scoring":
        return BatchScoring(context)
    if settings.name == "q-learning":
        prior = np.full(runs, settings.prior_value if settings.scoring_prior else 0.0)
        return BatchQLearning(context, prior, np.full(runs, settings.learning_rate), np.full(runs, settings.discount))
    if settings.name == "planner":
        return BatchPlanner(context, runs)
    return OneByOne(context, learner_named(settings.name), runs)


def pick_each(probabilities: Floats, u: Floats) -> Ints:
    """Apply :func:`shift_model.random_numbers.pick` to each row of ``probabilities`` [runs, actions]."""
    above: Bools = np.cumsum(probabilities, axis=1) > u[:, None]
    last = probabilities.shape[1] - 1 - (probabilities[:, ::-1] > 0).argmax(axis=1)
    actions: Ints = np.where(above[:, -1], above.argmax(axis=1), last)
    return actions


class BatchScoring:
    """The learner that always takes the suggested action."""

    def __init__(self, context: Context) -> None:
        self._suggested = np.array(context.suggestions)

    def decide(self, triple: Ints, u: Floats) -> Ints:
        """Return the suggested action of each run."""
        chosen: Ints = self._suggested[triple]
        return chosen

    def learn(self, triple: Ints, action: Ints, reward: Floats) -> None:
        """Learn nothing: the policy is fixed."""


class BatchQLearning:
    """The paper's learner (``shift_learner.learners.q_learning``), with parameters for each run.

    The update needs the next state, so it is made before the next decision, as in the paper's simulation.
    In the live mesh, with a discount above 0, the update is part of that next decision.
    """

    def __init__(self, context: Context, prior: Floats, learning_rate: Floats, discount: Floats) -> None:
        runs, actions = len(prior), context.actions
        self._suggested = np.array(context.suggestions)
        self._study = context.study
        self._rate, self._discount = learning_rate, discount
        self._values = np.eye(actions) * prior[:, None, None]
        self._tried = np.zeros((runs, actions), bool)
        self._runs = np.arange(runs)
        self._decisions = 0
        self._pending: tuple[Ints, Ints, Floats] | None = None

    def decide(self, triple: Ints, u: Floats) -> Ints:
        """Apply the pending update, then draw an action: epsilon-greedy, exploring the actions not yet tried."""
        state = self._suggested[triple]
        values = self._apply_pending(state)
        epsilon = decayed_epsilon(self._study.learner.epsilon, self._decisions, self._study.interactions)
        candidates: Bools = ~self._tried | self._tried.all(axis=1, keepdims=True)
        share = epsilon / candidates.sum(axis=1)
        row = np.where(candidates, share[:, None], 0.0)
        row[self._runs, values.argmax(axis=1)] += 1.0 - epsilon
        action = pick_each(row, u)
        self._tried[self._runs, action] = True
        self._decisions += 1
        return action

    def learn(self, triple: Ints, action: Ints, reward: Floats) -> None:
        """Store the reward until the next state is known."""
        self._pending = self._suggested[triple], action, reward

    def _apply_pending(self, next_state: Ints) -> Floats:
        """Apply the pending update, and return the rows of the next states."""
        if self._pending is not None:
            state, action, reward = self._pending
            self._values[self._runs, state, action] = updated_value(
                self._values[self._runs, state, action],
                reward,
                self._values[self._runs, next_state].max(axis=1),
                learning_rate=self._rate,
                discount=self._discount,
            )
        rows: Floats = self._values[self._runs, next_state]
        return rows


class BatchPlanner:
    """The planner: its engine computes all runs at once."""

    def __init__(self, context: Context, runs: int) -> None:
        self._model = engine.model_of(context)
        self._state = engine.initial(self._model, runs)

    def decide(self, triple: Ints, u: Floats) -> Ints:
        """Return the best action of each run; of equal ones, the first."""
        action: Ints = engine.values_at(self._model, self._state, triple).argmax(axis=1)
        self._state = engine.on_decision(self._model, self._state, triple, action)
        return action

    def learn(self, triple: Ints, action: Ints, reward: Floats) -> None:
        """Learn from success or failure: a reward above 0 is a success."""
        self._state = engine.on_result(self._model, self._state, triple, action, reward > 0)


class OneByOne:
    """Any learner of the services, with one memory for each run."""

    def __init__(self, context: Context, learner: Learner, runs: int) -> None:
        self._context, self._learner = context, learner
        self._memories: list[Any] = [learner.initial(context) for _ in range(runs)]
        self._taken: list[DecisionView] = []
        self._n = 0

    def decide(self, triple: Ints, u: Floats) -> Ints:
        """Return the action of each run, drawn from its row as the decider draws."""
        self._n += 1
        self._taken = [self._decide_run(run, int(t), float(u[run])) for run, t in enumerate(triple)]
        return np.array([taken.action for taken in self._taken])

    def _decide_run(self, run: int, triple: int, u: float) -> DecisionView:
        state = self._context.suggestions[triple]
        memory = self._memories[run]
        row = self._learner.row(self._context, memory, triple if self._learner.on_triples else state).probabilities
        action = pick(row, u)
        taken = DecisionView(self._n, triple, state, action, row[action])
        self._memories[run] = self._learner.on_decision(self._context, memory, taken)
        return taken

    def learn(self, triple: Ints, action: Ints, reward: Floats) -> None:
        """Update the memory of each run with its reward; these learners use no discount."""
        for run, taken in enumerate(self._taken):
            memory = self._memories[run]
            self._memories[run] = self._learner.on_reward(self._context, memory, taken, float(reward[run]), None)
