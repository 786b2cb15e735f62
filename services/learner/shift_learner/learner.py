"""What a learner is: three pure functions over a memory of its own, and a row of the policy.

A learner knows the scoring system (through :class:`Context`), never the person. Its memory is
immutable by convention: each function gives a new one, so a failed commit leaves the old one standing.
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
    """What every learner may know: the study, and what its scoring system suggests."""

    study: Study

    @cached_property
    def suggestions(self) -> tuple[int, ...]:
        """Index of the suggested action for each of the 30 triples, in their order."""
        return suggestions(self.study.scoring)

    @cached_property
    def actions(self) -> int:
        """How many actions there are."""
        return len(self.study.scoring.actions)

    @cached_property
    def cognitive_states(self) -> tuple[str, ...]:
        """The cognitive states, one per action, in the actions' order."""
        return self.study.scoring.states


class Taken(NamedTuple):
    """A decision as a learner sees it."""

    n: int
    """Its number, from 1."""
    triple: int
    """Index of the monitoring state, 0..29."""
    cognitive_state: int
    """Index of the cognitive state."""
    action: int
    """Index of the action."""
    propensity: float | None
    """None: an override."""


class Row(NamedTuple):
    """The policy in one state: true probabilities, the values behind them, reported visits."""

    probabilities: list[float]
    values: list[float]
    visits: list[int]


class Learner(Protocol):
    """A learner. ``memory`` is whatever its :meth:`initial` gives; ``dump`` makes plain JSON of it."""

    name: str
    on_triples: bool
    """Whether its states are the 30 triples, else the cognitive states."""

    def initial(self, context: Context) -> Any:
        """The memory before the first decision."""

    def decided(self, context: Context, memory: Any, taken: Taken) -> Any:
        """The memory after a decision was made (before its reward is known)."""

    def rewarded(self, context: Context, memory: Any, taken: Taken, reward: float, following: Taken | None) -> Any:
        """The memory after the reward of ``taken``.

        ``following`` is the next decision, given only where :meth:`needs_following` asks for it.
        """

    def needs_following(self, context: Context) -> bool:
        """Whether an update has to wait for the next state (a discount above 0)."""

    def row(self, context: Context, memory: Any, state: int) -> Row:
        """The row of the state with this index (cognitive state or triple) for the next decision."""

    def epsilon(self, context: Context, memory: Any) -> float | None:
        """Probability of exploring at the next decision, where the learner has one."""

    def dump(self, memory: Any) -> Any:
        """The memory as plain JSON values."""

    def load(self, context: Context, data: Any) -> Any:
        """The memory that :meth:`dump` wrote."""


def state_names(learner: Learner, context: Context) -> Sequence[str]:
    """The names of the learner's states, in the order of their indices."""
    return [t.name for t in TRIPLES] if learner.on_triples else context.cognitive_states


def state_of(learner: Learner, taken: Taken) -> int:
    """The index of the learner's state in which a decision was made."""
    return taken.triple if learner.on_triples else taken.cognitive_state
