"""What bandits on the 30 triples share: how often each action was taken there, and the sum of its rewards.

A bandit on triples is this and a :meth:`Tabular.row`; ``docs/learners.md`` adds one in twenty lines.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from shift_model.vocabulary import TRIPLES

from shift_learner.learner import Context, Row, Taken

Counts = tuple[tuple[int, ...], ...]
Sums = tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class Memory:
    """Reported visits and their sum of rewards, [30][actions], and the decisions made."""

    visits: Counts
    rewards: Sums
    decisions: int = 0


class Tabular:
    """A learner whose memory is counts and sums; it publishes a row for each triple."""

    name: str
    on_triples = True

    def initial(self, context: Context) -> Memory:
        """Nothing seen."""
        n = context.actions
        return Memory(((0,) * n,) * len(TRIPLES), ((0.0,) * n,) * len(TRIPLES))

    def decided(self, context: Context, memory: Memory, taken: Taken) -> Memory:
        """One decision more."""
        return replace(memory, decisions=memory.decisions + 1)

    def rewarded(
        self, context: Context, memory: Memory, taken: Taken, reward: float, following: Taken | None
    ) -> Memory:
        """One visit more, and its reward."""
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
        """Never: a bandit."""
        return False

    def row(self, context: Context, memory: Memory, state: int) -> Row:
        """The policy at a triple."""
        raise NotImplementedError

    def epsilon(self, context: Context, memory: Memory) -> float | None:
        """None, unless it has one."""
        return None

    def dump(self, memory: Memory) -> Any:
        """Plain lists."""
        return [memory.visits, memory.rewards, memory.decisions]

    def load(self, context: Context, data: Any) -> Memory:
        """Tuples again."""
        visits, rewards, decisions = data
        return Memory(tuple(map(tuple, visits)), tuple(map(tuple, rewards)), decisions)


def prior_values(context: Context, triple: int) -> list[float]:
    """``prior_value`` on the suggested action, 0 elsewhere and without the scoring prior."""
    settings = context.study.learner
    prior = settings.prior_value if settings.scoring_prior else 0.0
    return [prior if action == context.suggestions[triple] else 0.0 for action in range(context.actions)]


def greedy(values: list[float]) -> list[float]:
    """All probability on the first of the largest."""
    best = values.index(max(values))
    return [float(action == best) for action in range(len(values))]
