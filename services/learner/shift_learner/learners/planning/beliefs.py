"""Beliefs about the person of each run: which plausible person it is, and how probable success is. Pure.

Arrays have a leading axis of runs, which is 1 in a live session. Three experts predict whether an action succeeds:

1. *wrong entries*: for each strategy a posterior over its 2**10 columns. An action succeeds if the level of every
   strategy suits. The posteriors of the strategies are treated as independent, and each is updated with the
   expectation of the others (assumed density filtering, Minka 2001).
2. *a preference*: the exact posterior over the list of preferences.
3. *nothing known*: counts of the results of each action at each triple, a Beta posterior that slowly forgets.

The experts are averaged by the quality of their predictions (Bayesian model averaging, Hoeting et al. 1999), so the
third one prevails where both ideas of the person are wrong.
People change: after every result each posterior returns a small share to its prior (fixed share, Herbster & Warmuth
1998). This is exact for a person who is replaced by another one with that probability.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from shift_study.study import LearnerSettings

from shift_learner.learners.planning.plausible import Bools, Floats, Ints, Plausible

LOW, HIGH = 0.025, 0.975
"""Probability of success if one of the first two experts says no, or yes; chosen: one result in forty is chance."""
EXPERTS = (0.5, 0.4, 0.1)
"""Prior weights of the three experts; chosen on people generated around other tables (docs/learners.md)."""
COUNT_SUCCESS, COUNT_FAILURE = 0.3, 0.7
"""Beta prior of the counts; chosen: an unknown action mostly fails, and one trial decides."""
COUNT_MEMORY = 0.98
"""Share of the counts that is kept at each result; chosen: half is forgotten after 34 results."""


@dataclass(frozen=True)
class Priors:
    """The start of all beliefs, to which each result returns a share."""

    plausible: Plausible
    columns: tuple[Floats, ...]
    experts: Floats
    change: float


@dataclass(frozen=True)
class Beliefs:
    """The posterior weights, [runs, ...] each."""

    prior: Priors
    columns: tuple[Floats, ...]
    preferences: Floats
    successes: Floats
    failures: Floats
    experts: Floats

    @cached_property
    def chances(self) -> Floats:
        """The probability of success, [runs, 30, actions]."""
        people = self.prior.plausible
        suits: Floats = np.ones(())
        for s, (weights, column) in enumerate(zip(self.columns, people.columns, strict=True)):
            by_level = (weights @ column.suits).reshape(len(weights), -1, column.levels)
            suits = suits * by_level[:, :, people.levels[:, s]]
        preferred = (self.preferences @ people.preferences.success).reshape(np.shape(suits))
        counted = _counted_chances(self.successes, self.failures).reshape(np.shape(suits))
        first, second, third = (self.experts[:, i, None, None] for i in range(3))
        mixed: Floats = first * _with_noise(suits) + second * _with_noise(preferred) + third * counted
        return mixed

    def of(self, runs: slice) -> Beliefs:
        """Return the beliefs of some runs; for all runs, return the same object."""
        if runs.start == 0 and runs.stop >= len(self.experts):
            return self
        columns = tuple(column[runs] for column in self.columns)
        rest = (self.preferences[runs], self.successes[runs], self.failures[runs], self.experts[runs])
        return Beliefs(self.prior, columns, *rest)


def priors(plausible: Plausible, settings: LearnerSettings) -> Priors:
    """Return the priors of these settings; without the scoring prior, only the third expert remains."""
    flip = settings.flip_probability
    columns = []
    for column in plausible.columns:
        weight = flip**column.flips * (1 - flip) ** (column.flips.max() - column.flips)
        columns.append(weight / weight.sum())
    experts = np.array(EXPERTS if settings.scoring_prior else (0.0, 0.0, 1.0))
    return Priors(plausible, tuple(columns), experts, settings.change_probability)


def initial(prior: Priors, runs: int) -> Beliefs:
    """Return the beliefs before the first result."""
    counts = np.zeros((runs, prior.plausible.preferences.success.shape[1]))
    return Beliefs(
        prior,
        tuple(np.repeat(column[None], runs, axis=0) for column in prior.columns),
        np.repeat(prior.plausible.preferences.prior[None], runs, axis=0),
        counts,
        counts,
        np.repeat(prior.experts[None], runs, axis=0),
    )


def update(beliefs: Beliefs, triple: Ints, action: Ints, success: Bools) -> Beliefs:
    """Return the beliefs after a result in each run; the arguments are [runs] each."""
    prior = beliefs.prior
    people = prior.plausible
    runs, cell = np.arange(len(triple)), triple * len(people.levels) + action
    suited = [c.suits_by_level[triple * c.levels + people.levels[action, s]] for s, c in enumerate(people.columns)]
    fit = [_dot(w, s) for w, s in zip(beliefs.columns, suited, strict=True)]
    right = people.preferences.success_by_cell[cell]
    predicted = np.stack(
        [
            _with_noise(np.prod(fit, axis=0)),
            _with_noise(_dot(beliefs.preferences, right)),
            _counted_chances(beliefs.successes[runs, cell], beliefs.failures[runs, cell]),
        ],
        axis=1,
    )
    experts = beliefs.experts * np.where(success[:, None], predicted, 1 - predicted)
    return Beliefs(
        prior,
        tuple(
            _with_share(w * _column_likelihood(s, fit, i, success), prior.columns[i], prior.change)
            for i, (w, s) in enumerate(zip(beliefs.columns, suited, strict=True))
        ),
        _with_share(beliefs.preferences * _likelihood(right, success), people.preferences.prior, prior.change),
        _add_counts(beliefs.successes, (runs, cell), success),
        _add_counts(beliefs.failures, (runs, cell), ~success),
        _with_share(experts, prior.experts, prior.change),
    )


# --- pieces ---


def _with_noise(right: Floats | float) -> Floats:
    """Return the probability of success, given the probability that the action is a right one."""
    return np.asarray(LOW + (HIGH - LOW) * right)


def _likelihood(right: Floats, success: Bools) -> Floats:
    """Return the likelihood of the result for each hypothesis, [runs, hypotheses].

    It is :func:`_with_noise` after a success, and 1 minus it after a failure.
    """
    wrong, step = _line(success)
    likelihood: Floats = right * step
    likelihood += wrong
    return likelihood


def _line(success: Bools) -> tuple[Floats, Floats]:
    """Return the likelihood of the result of a wrong action, and what a right one adds to it, [runs, 1] each."""
    sign = np.where(success, 1.0, -1.0)[:, None]
    return np.where(success, LOW, 1 - LOW)[:, None], sign * (HIGH - LOW)


def _column_likelihood(suited: Floats, fit: list[Floats], own: int, success: Bools) -> Floats:
    """Return the likelihood for each column of strategy ``own``, given the expectation of the other strategies."""
    others = np.ones(len(success))
    for s, probability in enumerate(fit):
        if s != own:
            others = others * probability
    wrong, step = _line(success)
    likelihood: Floats = suited * (others[:, None] * step)
    likelihood += wrong
    return likelihood


def _dot(a: Floats, b: Floats) -> Floats:
    total: Floats = np.einsum("rk,rk->r", a, b)
    return total


def _with_share(weights: Floats, prior: Floats, change: float) -> Floats:
    """Normalise the weights and return a share to the prior, in place."""
    weights *= (1 - change) / weights.sum(axis=1, keepdims=True)
    weights += change * prior
    return weights


def _counted_chances(successes: Floats, failures: Floats) -> Floats:
    return (successes + COUNT_SUCCESS) / (successes + failures + (COUNT_SUCCESS + COUNT_FAILURE))


def _add_counts(counts: Floats, places: tuple[Ints, Ints], more: Bools) -> Floats:
    after = counts * COUNT_MEMORY
    after[places] += more
    return after
