"""Thompson sampling with Beta posteriors (Thompson 1933; Chapelle & Li 2011).

A result is a success when its reward is above 0. Each state and action has Beta(1 + successes, 1 + failures); the
scoring prior adds ``prior_strength`` imagined successes to the suggested action and as many failures to the others.
States are the six cognitive states or the 30 triples (``thompson_states``); rows are published per triple either
way. The row is the probability that the action's sample would be the largest, integrated, not sampled.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from shift_model.vocabulary import TRIPLES

from shift_learner.learner import Context, Row, Taken
from shift_learner.learners.largest import chances_of_largest

POINTS = 1025
"""Chosen: of the grid on 0..1; against 16 times as many a row changes by less than 5e-5 up to 100 results."""

Counts = tuple[tuple[int, ...], ...]


@dataclass(frozen=True)
class Memory:
    """Successes and failures per triple, [30][actions]: so the setting may change while a session runs."""

    successes: Counts
    failures: Counts


class Thompson:
    """See the module."""

    name = "thompson"
    on_triples = True

    def initial(self, context: Context) -> Memory:
        """Nothing seen."""
        empty = ((0,) * context.actions,) * len(TRIPLES)
        return Memory(empty, empty)

    def decided(self, context: Context, memory: Memory, taken: Taken) -> Memory:
        """Nothing changes."""
        return memory

    def rewarded(
        self, context: Context, memory: Memory, taken: Taken, reward: float, following: Taken | None
    ) -> Memory:
        """One success or failure more."""
        if reward > 0:
            return replace(memory, successes=_counted(memory.successes, taken))
        return replace(memory, failures=_counted(memory.failures, taken))

    def needs_following(self, context: Context) -> bool:
        """Never: a bandit."""
        return False

    def row(self, context: Context, memory: Memory, state: int) -> Row:
        """Each action's probability of the largest sample; the values are the posteriors' means."""
        settings = context.study.learner
        alike = _alike(context, state)
        successes, failures = (
            [sum(counts[t][action] for t in alike) for action in range(context.actions)]
            for counts in (memory.successes, memory.failures)
        )
        strength = settings.prior_strength if settings.scoring_prior else 0.0
        suggested = [action == context.suggestions[state] for action in range(context.actions)]
        a = tuple(1 + n + strength * yes for n, yes in zip(successes, suggested, strict=True))
        b = tuple(1 + n + strength * (not yes) for n, yes in zip(failures, suggested, strict=True))
        means = [x / (x + y) for x, y in zip(a, b, strict=True)]
        visits = [s + f for s, f in zip(successes, failures, strict=True)]
        return Row(list(chances(a, b)), means, visits)

    def epsilon(self, context: Context, memory: Memory) -> None:
        """It explores by its doubt."""

    def dump(self, memory: Memory) -> Any:
        """Plain lists."""
        return [memory.successes, memory.failures]

    def load(self, context: Context, data: Any) -> Memory:
        """Tuples again."""
        return Memory(*(tuple(map(tuple, counts)) for counts in data))


def _alike(context: Context, triple: int) -> list[int]:
    """The triples whose results count for this one."""
    if context.study.learner.thompson_states == "triples":
        return [triple]
    return [t for t, action in enumerate(context.suggestions) if action == context.suggestions[triple]]


def _counted(counts: Counts, taken: Taken) -> Counts:
    row = list(counts[taken.triple])
    row[taken.action] += 1
    return (*counts[: taken.triple], tuple(row), *counts[taken.triple + 1 :])


@lru_cache(maxsize=8192)
def chances(a: tuple[float, ...], b: tuple[float, ...]) -> tuple[float, ...]:
    """Probability that each of independent Beta(a, b) samples is the largest; a, b at least 1."""
    x = np.linspace(0.0, 1.0, POINTS)
    with np.errstate(divide="ignore"):
        up, down = np.log(x), np.log1p(-x)
    up[0] = down[-1] = -1e9  # the ends: a power of 0 that is above 0 vanishes, the power 0 is 1
    logs = np.outer(np.array(a) - 1, up) + np.outer(np.array(b) - 1, down)
    return tuple(chances_of_largest(np.exp(logs - logs.max(axis=1, keepdims=True))))
