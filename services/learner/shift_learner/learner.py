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
from shift_study.scoring_table import strategy_name
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
    def prior(self) -> tuple[tuple[float, ...], ...]:
        """How much the prior prefers each action in each cognitive state, 0..1, in the actions' order.

        With the scoring prior it is 1 for the suggested action and 0 for the others. A table of the study stands in its
        place: there it is an action's share, divided by the state's largest share. All is 0 without a prior.
        """
        settings, scoring = self.study.learner, self.study.scoring
        names = [strategy_name(choice) for choice in scoring.choices]
        rows = []
        for index, state in enumerate(scoring.states):
            shares = (settings.prior or {}).get(state, {})
            if largest := max(shares.values(), default=0.0):
                rows.append(tuple(shares.get(name, 0.0) / largest for name in names))
            else:
                rows.append(tuple(float(settings.scoring_prior and a == index) for a in range(self.actions)))
        return tuple(rows)

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
