"""Linear Thompson sampling: Bayesian linear regression of the reward for each action (Agrawal & Goyal 2013).

An action's reward is a sum of weights: one for each of the triple's three categories (ten in all), and one for
being the suggested action; so what is learned in one triple tells about those that share a category, and 100
interactions go further than on 30 triples by themselves. Weights have the prior N(0, 1 / ``prior_strength``), that
of being suggested the mean ``prior_value`` where the scoring system is the prior; rewards lie around the sum with the
standard deviation ``noise``. Actions have weights of their own (the disjoint model of Li et al. 2010), so their
samples are independent and the probability of the largest is an integral over one variable.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from shift_model.vocabulary import TRIPLES

from shift_learner.learner import Context, Row, Taken
from shift_learner.learners.largest import chances_of_largest

Floats = NDArray[np.float64]
FEATURES = 11
"""Two classes of capacity, three of gaze, five of awareness, and being suggested."""
POINTS = 1025
"""Chosen: of the grid over all means +- REACH standard deviations; a test compares with 400,000 samples."""
REACH = 7.0
LEAST_PRECISION = 1e-3
"""Of the prior, where ``prior_strength`` is 0: a prior that says next to nothing."""


@dataclass(frozen=True)
class Memory:
    """What the data add to the prior, per action; reported visits per triple. Arrays are never written to."""

    precision: Floats
    """[actions, FEATURES, FEATURES]: sum of x x'."""
    moment: Floats
    """[actions, FEATURES]: sum of x r."""
    visits: NDArray[np.int64]
    """[30, actions]"""


class LinearThompson:
    """See the module."""

    name = "linear-thompson"
    on_triples = True

    def initial(self, context: Context) -> Memory:
        """Nothing seen."""
        n = context.actions
        return Memory(np.zeros((n, FEATURES, FEATURES)), np.zeros((n, FEATURES)), np.zeros((len(TRIPLES), n), np.int64))

    def decided(self, context: Context, memory: Memory, taken: Taken) -> Memory:
        """Nothing changes."""
        return memory

    def rewarded(
        self, context: Context, memory: Memory, taken: Taken, reward: float, following: Taken | None
    ) -> Memory:
        """One observation more for the action's regression."""
        x = features(context, taken.triple)[taken.action]
        precision, moment, visits = memory.precision.copy(), memory.moment.copy(), memory.visits.copy()
        precision[taken.action] += np.outer(x, x)
        moment[taken.action] += reward * x
        visits[taken.triple, taken.action] += 1
        return replace(memory, precision=precision, moment=moment, visits=visits)

    def needs_following(self, context: Context) -> bool:
        """Never: a bandit."""
        return False

    def row(self, context: Context, memory: Memory, state: int) -> Row:
        """Each action's probability of the largest sample; the values are the posteriors' means."""
        means, deviations = posterior(context, memory, state)
        row = chances(tuple(means.tolist()), tuple(deviations.tolist()))
        return Row(list(row), means.tolist(), memory.visits[state].tolist())

    def epsilon(self, context: Context, memory: Memory) -> None:
        """It explores by its doubt."""

    def dump(self, memory: Memory) -> Any:
        """Plain lists; floats keep every digit."""
        return [memory.precision.tolist(), memory.moment.tolist(), memory.visits.tolist()]

    def load(self, context: Context, data: Any) -> Memory:
        """Arrays again."""
        return Memory(np.array(data[0]), np.array(data[1]), np.array(data[2], np.int64))


def features(context: Context, triple: int) -> Floats:
    """What each action's regression sees at a triple, [actions, FEATURES]: its three categories, and the suggestion."""
    x = np.zeros((context.actions, FEATURES))
    x[:, [triple // 15, 2 + triple // 5 % 3, 5 + triple % 5]] = 1.0
    x[context.suggestions[triple], -1] = 1.0
    return x


def posterior(context: Context, memory: Memory, triple: int) -> tuple[Floats, Floats]:
    """Mean and standard deviation of each action's expected reward at a triple, [actions] each."""
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
    """Probability that each of independent normal samples is the largest."""
    mean, deviation = np.array(means), np.array(deviations)
    x = np.linspace((mean - REACH * deviation).min(), (mean + REACH * deviation).max(), POINTS)
    return tuple(chances_of_largest(np.exp(-0.5 * ((x - mean[:, None]) / deviation[:, None]) ** 2)))
