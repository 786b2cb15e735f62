"""The common part of bandits on the 30 triples: visits and the sum of rewards of each action.

A bandit adds its own :meth:`Tabular.row`; ``docs/learners.md`` adds one in twenty lines.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from shift_model.vocabulary import TRIPLES

from shift_learner.learner import Context, DecisionView, Row

Counts = tuple[tuple[int, ...], ...]
Sums = tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class Memory:
    """Reported visits and their sums of rewards, [30][actions], and the number of decisions."""

    visits: Counts
    rewards: Sums
    decisions: int = 0


class Tabular:
    """A learner whose memory is counts and sums, with a row for each triple."""

    name: str
    on_triples = True

    def initial(self, context: Context) -> Memory:
        """Return a memory without visits."""
        n = context.actions
        return Memory(((0,) * n,) * len(TRIPLES), ((0.0,) * n,) * len(TRIPLES))

    def on_decision(self, context: Context, memory: Memory, taken: DecisionView) -> Memory:
        """Count the decision."""
        return replace(memory, decisions=memory.decisions + 1)

    def on_reward(
        self, context: Context, memory: Memory, taken: DecisionView, reward: float, following: DecisionView | None
    ) -> Memory:
        """Count the visit and add its reward."""
        at, action = taken.triple, taken.action
        visits, rewards = list(memory.visits[at]), list(memory.rewards[at])
        visits[action] += 1
        rewards[action] += reward
        return replace(
            memory,
            visits=(*memory.visits[:at], tuple(visits), *memory.visits[at + 1 :]),
            rewards=(*memory.rewards[:at], tuple(rewards), *memory.rewards[at + 1 :]),
        )

    def needs_following(self, context: Context) -> bool:
        """Return False: a bandit needs no next state."""
        return False

    def row(self, context: Context, memory: Memory, state: int) -> Row:
        """Return the policy at a triple."""
        raise NotImplementedError

    def epsilon(self, context: Context, memory: Memory) -> float | None:
        """Return None; a subclass with an exploration rate overrides this."""
        return None

    def dump(self, memory: Memory) -> Any:
        """Return plain lists."""
        return [memory.visits, memory.rewards, memory.decisions]

    def load(self, context: Context, data: Any) -> Memory:
        """Return the memory with its tuples."""
        visits, rewards, decisions = data
        return Memory(tuple(map(tuple, visits)), tuple(map(tuple, rewards)), decisions)


def prior_values(context: Context, triple: int) -> list[float]:
    """Return the value of each action before any report: ``prior_value`` times the preference of the prior."""
    value = context.study.learner.prior_value
    return [value * preference for preference in context.prior[context.suggestions[triple]]]


def greedy(values: list[float]) -> list[float]:
    """Return all probability on the first of the largest values."""
    best = values.index(max(values))
    return [float(action == best) for action in range(len(values))]
