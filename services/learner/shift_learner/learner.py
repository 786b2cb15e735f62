"""The interface of a learner: pure functions over its own memory, and the rows of its policy.

A learner knows the scoring system (through :class:`Context`), never the person. Its memory is immutable by
convention: each function returns a new one, so a failed commit leaves the old one unchanged.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, Protocol

from shift_model.vocabulary import TRIPLES
from shift_study.scoring import suggestions
from shift_study.study import Study


@dataclass(frozen=True)
class Context:
    """The knowledge of every learner: the study, and the suggestions of its scoring system."""

    study: Study

    @cached_property
    def suggestions(self) -> tuple[int, ...]:
        """The index of the suggested action for each of the 30 triples, in their order."""
        return suggestions(self.study.scoring)

    @cached_property
    def actions(self) -> int:
        """The number of actions."""
        return len(self.study.scoring.actions)

    @cached_property
    def cognitive_states(self) -> tuple[str, ...]:
        """The cognitive states, one per action, in the actions' order."""
        return self.study.scoring.states


class DecisionView(NamedTuple):
    """A decision as a learner sees it."""

    n: int
    """The number of the decision, from 1."""
    triple: int
    """Index of the monitoring state, 0..29."""
    cognitive_state: int
    """Index of the cognitive state."""
    action: int
    """Index of the action."""
    propensity: float | None
    """None for an override."""


class Row(NamedTuple):
    """The policy in one state: the exact probabilities, the values behind them, and the reported visits."""

    probabilities: list[float]
    values: list[float]
    visits: list[int]


class Learner(Protocol):
    """A learner. ``memory`` is of the type that :meth:`initial` returns."""

    name: str
    on_triples: bool
    """Whether its states are the 30 triples; otherwise they are the cognitive states."""

    def initial(self, context: Context) -> Any:
        """Return the memory before the first decision."""

    def on_decision(self, context: Context, memory: Any, taken: DecisionView) -> Any:
        """Return the memory after a decision, before its reward is known."""

    def on_reward(
        self, context: Context, memory: Any, taken: DecisionView, reward: float, following: DecisionView | None
    ) -> Any:
        """Return the memory after the reward of ``taken``.

        ``following`` is the next decision; it is given only if :meth:`needs_following` returns True.
        """

    def needs_following(self, context: Context) -> bool:
        """Return whether an update must wait for the next state (a discount above 0)."""

    def row(self, context: Context, memory: Any, state: int) -> Row:
        """Return the row of the state with this index (cognitive state or triple) for the next decision."""

    def epsilon(self, context: Context, memory: Any) -> float | None:
        """Return the probability of exploring at the next decision, or None if the learner has no such rate."""

    def dump(self, memory: Any) -> Any:
        """Return the memory as plain JSON values."""

    def load(self, context: Context, data: Any) -> Any:
        """Return the memory that :meth:`dump` wrote."""


def state_names(learner: Learner, context: Context) -> Sequence[str]:
    """Return the names of the learner's states, in the order of their indices."""
    return [t.name for t in TRIPLES] if learner.on_triples else context.cognitive_states


def state_of(learner: Learner, taken: DecisionView) -> int:
    """Return the index of the learner's state in which a decision was made."""
    return taken.triple if learner.on_triples else taken.cognitive_state
