"""Beliefs about one person (or one per run): who of the plausible people it is, and how probable success is.

Pure; arrays have a leading axis of runs, live it is 1. Three experts predict whether an action succeeds:

1. *wrong entries*: for each strategy a posterior over its 2**10 columns. An action succeeds when every strategy's
   level suits; the strategies' posteriors are held as independent and each is updated with the others' expectation
   (assumed density filtering, Minka 2001).
2. *a preference*: the exact posterior over the list of preferences.
3. *nothing known*: plain counts of what each action did at each triple, a Beta posterior that slowly forgets.

They are averaged by how well each has predicted (Bayesian model averaging, Hoeting et al. 1999), so that the last
takes over where both ideas of the person are wrong.
People change: after every result each posterior gives a small share back to its prior (fixed share, Herbster &
Warmuth 1998), which is exact for somebody who is replaced by another with that probability.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from shift_study.study import LearnerSettings

from shift_learner.learners.planning.plausible import Bools, Floats, Ints, Plausible

LOW, HIGH = 0.025, 0.975
"""Chance of success where an expert of the first two says no, or yes; chosen: one in forty is chance."""
EXPERTS = (0.5, 0.4, 0.1)
"""Prior of the three; chosen on people generated around other tables (docs/learners.md)."""
COUNT_SUCCESS, COUNT_FAILURE = 0.3, 0.7
"""Beta prior of counts; chosen: an action that nothing is known of mostly fails, and one trial decides."""
COUNT_MEMORY = 0.98
"""What is kept of the counts at each result; chosen: half is gone after 34."""


@dataclass(frozen=True)
class Priors:
    """Where beliefs start, and what they give back to."""

    plausible: Plausible
    columns: tuple[Floats, ...]
    experts: Floats
    change: float


@dataclass(frozen=True)
class Beliefs:
    """Posterior weights, [runs, ...] each."""

    prior: Priors
    columns: tuple[Floats, ...]
    preferences: Floats
    successes: Floats
    failures: Floats
    experts: Floats

    @cached_property
    def chances(self) -> Floats:
        """Probability of success, [runs, 30, actions]."""
        people = self.prior.plausible
        suits: Floats = np.ones(())
        for s, (weights, column) in enumerate(zip(self.columns, people.columns, strict=True)):
            by_level = (weights @ column.suits).reshape(len(weights), -1, column.levels)
            suits = suits * by_level[:, :, people.levels[:, s]]
        preferred = (self.preferences @ people.preferences.success).reshape(np.shape(suits))
        counted = _counted_chances(self.successes, self.failures).reshape(np.shape(suits))
        first, second, third = (self.experts[:, i, None, None] for i in range(3))
        mixed: Floats = first * _noisy(suits) + second * _noisy(preferred) + third * counted
        return mixed

    def of(self, runs: slice) -> Beliefs:
        """Some of the runs; all of them are the same beliefs."""
        if runs.start == 0 and runs.stop >= len(self.experts):
            return self
        columns = tuple(column[runs] for column in self.columns)
        rest = (self.preferences[runs], self.successes[runs], self.failures[runs], self.experts[runs])
        return Beliefs(self.prior, columns, *rest)


def priors(plausible: Plausible, settings: LearnerSettings) -> Priors:
    """The priors that the settings ask for; without the scoring prior only the third expert is left."""
    flip = settings.flip_probability
    columns = []
    for column in plausible.columns:
        weight = flip**column.flips * (1 - flip) ** (column.flips.max() - column.flips)
        columns.append(weight / weight.sum())
    experts = np.array(EXPERTS if settings.scoring_prior else (0.0, 0.0, 1.0))
    return Priors(plausible, tuple(columns), experts, settings.change_probability)


def started(prior: Priors, runs: int) -> Beliefs:
    """Before the first result."""
    counts = np.zeros((runs, prior.plausible.preferences.success.shape[1]))
    return Beliefs(
        prior,
        tuple(np.repeat(column[None], runs, axis=0) for column in prior.columns),
        np.repeat(prior.plausible.preferences.prior[None], runs, axis=0),
        counts,
        counts,
        np.repeat(prior.experts[None], runs, axis=0),
    )


def told(beliefs: Beliefs, triple: Ints, action: Ints, success: Bools) -> Beliefs:
    """After a result in each run: [runs] each."""
    prior = beliefs.prior
    people = prior.plausible
    runs, cell = np.arange(len(triple)), triple * len(people.levels) + action
    suited = [c.suits_by_level[triple * c.levels + people.levels[action, s]] for s, c in enumerate(people.columns)]
    fit = [_dot(w, s) for w, s in zip(beliefs.columns, suited, strict=True)]
    right = people.preferences.success_by_cell[cell]
    predicted = np.stack(
        [
            _noisy(np.prod(fit, axis=0)),
            _noisy(_dot(beliefs.preferences, right)),
            _counted_chances(beliefs.successes[runs, cell], beliefs.failures[runs, cell]),
        ],
        axis=1,
    )
    experts = beliefs.experts * np.where(success[:, None], predicted, 1 - predicted)
    return Beliefs(
        prior,
        tuple(
            _shared(w * _column_likelihood(s, fit, i, success), prior.columns[i], prior.change)
            for i, (w, s) in enumerate(zip(beliefs.columns, suited, strict=True))
        ),
        _shared(beliefs.preferences * _likelihood(right, success), people.preferences.prior, prior.change),
        _counted(beliefs.successes, (runs, cell), success),
        _counted(beliefs.failures, (runs, cell), ~success),
        _shared(experts, prior.experts, prior.change),
    )


# --- pieces ---


def _noisy(right: Floats | float) -> Floats:
    """Chance of success where ``right`` is the probability that the action is a right one."""
    return np.asarray(LOW + (HIGH - LOW) * right)


def _likelihood(right: Floats, success: Bools) -> Floats:
    """Of the result, for each hypothesis: :func:`_noisy`, or 1 less it after a failure, [runs, hypotheses]."""
    wrong, step = _line(success)
    likelihood: Floats = right * step
    likelihood += wrong
    return likelihood


def _line(success: Bools) -> tuple[Floats, Floats]:
    """The likelihood of the result where an action is wrong, and what being right adds, [runs, 1] each."""
    sign = np.where(success, 1.0, -1.0)[:, None]
    return np.where(success, LOW, 1 - LOW)[:, None], sign * (HIGH - LOW)


def _column_likelihood(suited: Floats, fit: list[Floats], own: int, success: Bools) -> Floats:
    """Of the result, for each column of strategy ``own``, the other strategies as expected."""
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


def _shared(weights: Floats, prior: Floats, change: float) -> Floats:
    """Normalised, and a share given back to the prior; in place."""
    weights *= (1 - change) / weights.sum(axis=1, keepdims=True)
    weights += change * prior
    return weights


def _counted_chances(successes: Floats, failures: Floats) -> Floats:
    return (successes + COUNT_SUCCESS) / (successes + failures + (COUNT_SUCCESS + COUNT_FAILURE))


def _counted(counts: Floats, places: tuple[Ints, Ints], more: Bools) -> Floats:
    after = counts * COUNT_MEMORY
    after[places] += more
    return after
