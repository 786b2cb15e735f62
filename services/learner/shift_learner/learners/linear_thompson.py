"""Linear Thompson sampling: Bayesian linear regression of the reward for each action (Agrawal & Goyal 2013).

The reward of an action is a sum of weights: one for each of the triple's three categories (ten in all), and one for
being the suggested action. So a result at one triple is also evidence for the triples that share a category, and 100
interactions teach more than on 30 separate triples. Weights have the prior N(0, 1 / ``prior_strength``); with the
scoring prior, the weight of being suggested has the mean ``prior_value``. Rewards have the standard deviation
``noise`` around the sum. Each action has its own weights (the disjoint model of Li et al. 2010), so the samples of
actions are independent and the probability of the largest one is an integral over one variable.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from shift_model.vocabulary import TRIPLES

from shift_learner.learner import Context, DecisionView, Row
from shift_learner.learners.largest import chances_of_largest

Floats = NDArray[np.float64]
FEATURES = 11
"""Two classes of capacity, three of gaze, five of awareness, and being the suggested action."""
POINTS = 1025
"""Chosen: the points of the grid; a test compares the result with 400,000 samples."""
REACH = 7.0
"""Chosen: the grid covers this many standard deviations around all means."""
LEAST_PRECISION = 1e-3
"""Chosen: the precision of the prior if ``prior_strength`` is 0, an almost flat prior."""


@dataclass(frozen=True)
class Memory:
    """The sums of the data for each action, and the reported visits of each triple. Arrays are never written to."""

    precision: Floats
    """[actions, FEATURES, FEATURES]: sum of x x'."""
    moment: Floats
    """[actions, FEATURES]: sum of x r."""
    visits: NDArray[np.int64]
    """[30, actions]"""


class LinearThompson:
    """A Thompson sampler with a linear model of the reward."""

    name = "linear-thompson"
    on_triples = True

    def initial(self, context: Context) -> Memory:
        """Return a memory without data."""
        n = context.actions
        return Memory(np.zeros((n, FEATURES, FEATURES)), np.zeros((n, FEATURES)), np.zeros((len(TRIPLES), n), np.int64))

    def on_decision(self, context: Context, memory: Memory, taken: DecisionView) -> Memory:
        """Return the memory unchanged."""
        return memory

    def on_reward(
        self, context: Context, memory: Memory, taken: DecisionView, reward: float, following: DecisionView | None
    ) -> Memory:
        """Add one observation to the action's regression."""
        x = features(context, taken.triple)[taken.action]
        precision, moment, visits = memory.precision.copy(), memory.moment.copy(), memory.visits.copy()
        precision[taken.action] += np.outer(x, x)
        moment[taken.action] += reward * x
        visits[taken.triple, taken.action] += 1
        return replace(memory, precision=precision, moment=moment, visits=visits)

    def needs_following(self, context: Context) -> bool:
        """Return False: a bandit needs no next state."""
        return False

    def row(self, context: Context, memory: Memory, state: int) -> Row:
        """Return the probability that each action's sample is the largest; the values are the posterior means."""
        means, deviations = posterior(context, memory, state)
        row = chances(tuple(means.tolist()), tuple(deviations.tolist()))
        return Row(list(row), means.tolist(), memory.visits[state].tolist())

    def epsilon(self, context: Context, memory: Memory) -> None:
        """Return None: exploration comes from posterior sampling, without a rate."""

    def dump(self, memory: Memory) -> Any:
        """Return plain lists; floats keep every digit."""
        return [memory.precision.tolist(), memory.moment.tolist(), memory.visits.tolist()]

    def load(self, context: Context, data: Any) -> Memory:
        """Return the memory with its arrays."""
        return Memory(np.array(data[0]), np.array(data[1]), np.array(data[2], np.int64))


def features(context: Context, triple: int) -> Floats:
    """Return the features of each action at a triple, [actions, FEATURES]: three categories and the suggestion."""
    x = np.zeros((context.actions, FEATURES))
    x[:, [triple // 15, 2 + triple // 5 % 3, 5 + triple % 5]] = 1.0
    x[context.suggestions[triple], -1] = 1.0
    return x


def posterior(context: Context, memory: Memory, triple: int) -> tuple[Floats, Floats]:
    """Return mean and standard deviation of each action's expected reward at a triple, [actions] each."""
    settings = context.study.learner
    strength = max(settings.prior_strength, LEAST_PRECISION)
    mean = np.zeros(FEATURES)
    mean[-1] = settings.prior_value * settings.scoring_prior
    noise = settings.noise**2
    precision = memory.precision / noise + strength * np.eye(FEATURES)
    moment = memory.moment / noise + strength * mean
    x = features(context, triple)
    solved = np.linalg.solve(precision, np.stack([moment, x], axis=2))  # [actions, FEATURES, 2]
    return (x * solved[:, :, 0]).sum(axis=1), np.sqrt((x * solved[:, :, 1]).sum(axis=1))


@lru_cache(maxsize=4096)
def chances(means: tuple[float, ...], deviations: tuple[float, ...]) -> tuple[float, ...]:
    """Return the probability that each of several independent normal samples is the largest."""
    mean, deviation = np.array(means), np.array(deviations)
    x = np.linspace((mean - REACH * deviation).min(), (mean + REACH * deviation).max(), POINTS)
    return tuple(chances_of_largest(np.exp(-0.5 * ((x - mean[:, None]) / deviation[:, None]) ** 2)))
