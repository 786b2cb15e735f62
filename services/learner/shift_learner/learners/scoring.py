"""Scoring only: the suggestion of the scoring system, always. It counts what it sees and learns nothing.

The baseline of the paper's claim (each cognitive state *is* its action, section III-C).
"""

from __future__ import annotations

from typing import Any

from shift_learner.learner import Context, Row, Taken

Visits = tuple[tuple[int, ...], ...]


class Scoring:
    """See the module."""

    name = "scoring"
    on_triples = False

    def initial(self, context: Context) -> Visits:
        """No visits yet."""
        return tuple((0,) * context.actions for _ in context.cognitive_states)

    def decided(self, context: Context, memory: Visits, taken: Taken) -> Visits:
        """Nothing changes."""
        return memory

    def rewarded(
        self, context: Context, memory: Visits, taken: Taken, reward: float, following: Taken | None
    ) -> Visits:
        """Count the visit."""
        row = memory[taken.cognitive_state]
        counted = (*row[: taken.action], row[taken.action] + 1, *row[taken.action + 1 :])
        return (*memory[: taken.cognitive_state], counted, *memory[taken.cognitive_state + 1 :])

    def needs_following(self, context: Context) -> bool:
        """Never."""
        return False

    def row(self, context: Context, memory: Visits, state: int) -> Row:
        """All probability on the state's own action."""
        suggested = [float(action == state) for action in range(context.actions)]
        return Row(suggested, list(suggested), list(memory[state]))

    def epsilon(self, context: Context, memory: Visits) -> None:
        """It does not explore."""

    def dump(self, memory: Visits) -> Any:
        """Lists of visits."""
        return memory

    def load(self, context: Context, data: Any) -> Visits:
        """Tuples again."""
        return tuple(tuple(row) for row in data)
