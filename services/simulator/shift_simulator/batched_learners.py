"""Learners for many runs at once.

Q-learning and scoring are written for arrays over runs (a test holds them to the learners that the services
run, bit for bit); any other learner is run as it is, one run after the other, and the planner brings a batched
form of its own.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from shift_learner.learner import Context, Learner, Taken
from shift_learner.learners import learner_named
from shift_learner.learners.planning import engine
from shift_model.q_learning import decayed_epsilon, updated_value
from shift_model.random_numbers import pick

from shift_simulator.random_streams import Bools, Floats, Ints


class BatchLearner(Protocol):
    """A learner of many runs, each by itself."""

    def decide(self, triple: Ints, u: Floats) -> Ints:
        """The action of each run: its policy's row at ``triple`` [runs], drawn with ``u`` [runs] in [0, 1)."""

    def learn(self, triple: Ints, action: Ints, reward: Floats) -> None:
        """The reward of the decision just made, each [runs]."""


def batch_learner(context: Context, runs: int) -> BatchLearner:
    """The study's learner for ``runs`` runs."""
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
    """:func:`shift_model.random_numbers.pick` for each row of ``probabilities`` [runs, actions]."""
    reached: Bools = np.cumsum(probabilities, axis=1) > u[:, None]
    last = probabilities.shape[1] - 1 - (probabilities[:, ::-1] > 0).argmax(axis=1)
    found: Ints = np.where(reached[:, -1], reached.argmax(axis=1), last)
    return found


class BatchScoring:
    """The suggestion, always."""

    def __init__(self, context: Context) -> None:
        self._suggested = np.array(context.suggestions)

    def decide(self, triple: Ints, u: Floats) -> Ints:
        """What the scoring system suggests."""
        chosen: Ints = self._suggested[triple]
        return chosen

    def learn(self, triple: Ints, action: Ints, reward: Floats) -> None:
        """Nothing."""


class BatchQLearning:
    """The paper's learner (``shift_learner.learners.q_learning``), its parameters given per run.

    The update waits for the next state and is made before the next decision, as the paper's simulation does it;
    live, with a discount above 0, it lands with that decision instead.
    """

    def __init__(self, context: Context, prior: Floats, learning_rate: Floats, discount: Floats) -> None:
        runs, actions = len(prior), context.actions
        self._suggested = np.array(context.suggestions)
        self._study = context.study
        self._rate, self._discount = learning_rate, discount
        self._values = np.eye(actions) * prior[:, None, None]
        self._taken = np.zeros((runs, actions), bool)
        self._runs = np.arange(runs)
        self._decisions = 0
        self._pending: tuple[Ints, Ints, Floats] | None = None

    def decide(self, triple: Ints, u: Floats) -> Ints:
        """Learn what waits for this state, then draw from epsilon-greedy over the actions never taken."""
        state = self._suggested[triple]
        values = self._updated(state)
        epsilon = decayed_epsilon(self._study.learner.epsilon, self._decisions, self._study.interactions)
        candidates: Bools = ~self._taken | self._taken.all(axis=1, keepdims=True)
        share = epsilon / candidates.sum(axis=1)
        row = np.where(candidates, share[:, None], 0.0)
        row[self._runs, values.argmax(axis=1)] += 1.0 - epsilon
        action = pick_each(row, u)
        self._taken[self._runs, action] = True
        self._decisions += 1
        return action

    def learn(self, triple: Ints, action: Ints, reward: Floats) -> None:
        """Remember it until the next state is known."""
        self._pending = self._suggested[triple], action, reward

    def _updated(self, following: Ints) -> Floats:
        """Apply the pending update; return the rows of the following states."""
        if self._pending is not None:
            state, action, reward = self._pending
            self._values[self._runs, state, action] = updated_value(
                self._values[self._runs, state, action],
                reward,
                self._values[self._runs, following].max(axis=1),
                learning_rate=self._rate,
                discount=self._discount,
            )
        rows: Floats = self._values[self._runs, following]
        return rows


class BatchPlanner:
    """The planner, its own engine folding all runs at once."""

    def __init__(self, context: Context, runs: int) -> None:
        self._model = engine.model_of(context)
        self._state = engine.initial(self._model, runs)

    def decide(self, triple: Ints, u: Floats) -> Ints:
        """The best action, the first of equals."""
        action: Ints = engine.values_at(self._model, self._state, triple).argmax(axis=1)
        self._state = engine.on_decision(self._model, self._state, triple, action)
        return action

    def learn(self, triple: Ints, action: Ints, reward: Floats) -> None:
        """A reward above 0 is a success."""
        self._state = engine.on_result(self._model, self._state, triple, action, reward > 0)


class OneByOne:
    """Any learner as the services run it, a memory for each run."""

    def __init__(self, context: Context, learner: Learner, runs: int) -> None:
        self._context, self._learner = context, learner
        self._memories: list[Any] = [learner.initial(context) for _ in range(runs)]
        self._taken: list[Taken] = []
        self._n = 0

    def decide(self, triple: Ints, u: Floats) -> Ints:
        """Each run's row, drawn as the decider draws."""
        self._n += 1
        self._taken = [self._decided(run, int(t), float(u[run])) for run, t in enumerate(triple)]
        return np.array([taken.action for taken in self._taken])

    def _decided(self, run: int, triple: int, u: float) -> Taken:
        state = self._context.suggestions[triple]
        memory = self._memories[run]
        row = self._learner.row(self._context, memory, triple if self._learner.on_triples else state).probabilities
        action = pick(row, u)
        taken = Taken(self._n, triple, state, action, row[action])
        self._memories[run] = self._learner.on_decision(self._context, memory, taken)
        return taken

    def learn(self, triple: Ints, action: Ints, reward: Floats) -> None:
        """Each run's memory after its reward; a discount has no meaning here."""
        for run, taken in enumerate(self._taken):
            memory = self._memories[run]
            self._memories[run] = self._learner.on_reward(self._context, memory, taken, float(reward[run]), None)
