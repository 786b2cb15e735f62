"""Scoring only: always the suggestion of the scoring system. It counts visits and learns nothing.

It is the baseline of the paper's claim (each cognitive state *is* its action, section III-C).
"""

from __future__ import annotations

from typing import Any

from shift_learner.learner import Context, DecisionView, Row

Visits = tuple[tuple[int, ...], ...]


class Scoring:
    """The baseline that always follows the scoring system."""

    name = "scoring"
    on_triples = False

    def initial(self, context: Context) -> Visits:
        """Return zero visits."""
        return tuple((0,) * context.actions for _ in context.cognitive_states)

    def on_decision(self, context: Context, memory: Visits, taken: DecisionView) -> Visits:
        """Return the memory unchanged."""
        return memory

    def on_reward(
        self, context: Context, memory: Visits, taken: DecisionView, reward: float, following: DecisionView | None
    ) -> Visits:
        """Count the visit."""
        row = memory[taken.cognitive_state]
        counted = (*row[: taken.action], row[taken.action] + 1, *row[taken.action + 1 :])
        return (*memory[: taken.cognitive_state], counted, *memory[taken.cognitive_state + 1 :])

    def needs_following(self, context: Context) -> bool:
        """Return False: nothing is learned."""
        return False

    def row(self, context: Context, memory: Visits, state: int) -> Row:
        """Put all probability on the state's own action."""
        suggested = [float(action == state) for action in range(context.actions)]
        return Row(suggested, list(suggested), list(memory[state]))

    def epsilon(self, context: Context, memory: Visits) -> None:
        """Return None: there is no exploration."""

    def dump(self, memory: Visits) -> Any:
        """Return the visits."""
        return memory

    def load(self, context: Context, data: Any) -> Visits:
        """Return the visits as tuples."""
        return tuple(tuple(row) for row in data)
