"""Thompson sampling with Beta posteriors (Thompson 1933; Chapelle & Li 2011).

A result is a success if its reward is above 0. Each state and action has the posterior Beta(1 + successes, 1 +
failures). The scoring prior adds ``prior_strength`` successes to the suggested action and as many failures to the
others. States are the six cognitive states or the 30 triples (``thompson_states``); a row is published for each
triple in both cases. The row is the probability that the action's sample is the largest, integrated, not sampled.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from shift_model.vocabulary import TRIPLES

from shift_learner.learner import Context, DecisionView, Row
from shift_learner.learners.largest import chances_of_largest

POINTS = 1025
"""Chosen: the points of the grid on 0..1; with 16 times as many, a row changes by less than 5e-5 up to 100 results."""

Counts = tuple[tuple[int, ...], ...]


@dataclass(frozen=True)
class Memory:
    """Successes and failures, [30][actions]; they are kept per triple, so the setting may change during a session."""

    successes: Counts
    failures: Counts


class Thompson:
    """A Thompson sampler with Beta posteriors."""

    name = "thompson"
    on_triples = True

    def initial(self, context: Context) -> Memory:
        """Return a memory without results."""
        empty = ((0,) * context.actions,) * len(TRIPLES)
        return Memory(empty, empty)

    def on_decision(self, context: Context, memory: Memory, taken: DecisionView) -> Memory:
        """Return the memory unchanged."""
        return memory

    def on_reward(
        self, context: Context, memory: Memory, taken: DecisionView, reward: float, following: DecisionView | None
    ) -> Memory:
        """Count one success or failure."""
        if reward > 0:
            return replace(memory, successes=_add_count(memory.successes, taken))
        return replace(memory, failures=_add_count(memory.failures, taken))

    def needs_following(self, context: Context) -> bool:
        """Return False: a bandit needs no next state."""
        return False

    def row(self, context: Context, memory: Memory, state: int) -> Row:
        """Return the probability that each action's sample is the largest; the values are the posterior means."""
        settings = context.study.learner
        alike = _same_state(context, state)
        successes, failures = (
            [sum(counts[t][action] for t in alike) for action in range(context.actions)]
            for counts in (memory.successes, memory.failures)
        )
        prior = context.prior[context.suggestions[state]]
        strength = settings.prior_strength if any(prior) else 0.0
        a = tuple(1 + n + strength * preferred for n, preferred in zip(successes, prior, strict=True))
        b = tuple(1 + n + strength * (1 - preferred) for n, preferred in zip(failures, prior, strict=True))
        means = [x / (x + y) for x, y in zip(a, b, strict=True)]
        visits = [s + f for s, f in zip(successes, failures, strict=True)]
        return Row(list(chances(a, b)), means, visits)

    def epsilon(self, context: Context, memory: Memory) -> None:
        """Return None: exploration comes from posterior sampling, without a rate."""

    def dump(self, memory: Memory) -> Any:
        """Return plain lists."""
        return [memory.successes, memory.failures]

    def load(self, context: Context, data: Any) -> Memory:
        """Return the memory with its tuples."""
        return Memory(*(tuple(map(tuple, counts)) for counts in data))


def _same_state(context: Context, triple: int) -> list[int]:
    """Return the triples whose results count for this one."""
    if context.study.learner.thompson_states == "triples":
        return [triple]
    return [t for t, action in enumerate(context.suggestions) if action == context.suggestions[triple]]


def _add_count(counts: Counts, taken: DecisionView) -> Counts:
    row = list(counts[taken.triple])
    row[taken.action] += 1
    return (*counts[: taken.triple], tuple(row), *counts[taken.triple + 1 :])


@lru_cache(maxsize=8192)
def chances(a: tuple[float, ...], b: tuple[float, ...]) -> tuple[float, ...]:
    """Return the probability that each of several independent Beta(a, b) samples is the largest; a, b at least 1."""
    x = np.linspace(0.0, 1.0, POINTS)
    with np.errstate(divide="ignore"):
        up, down = np.log(x), np.log1p(-x)
    up[0] = down[-1] = -1e9  # at the ends, a power above 0 is 0 and the power 0 is 1
    logs = np.outer(np.array(a) - 1, up) + np.outer(np.array(b) - 1, down)
    return tuple(chances_of_largest(np.exp(logs - logs.max(axis=1, keepdims=True))))
