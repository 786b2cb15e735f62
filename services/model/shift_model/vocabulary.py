"""The words of the messages, in their fixed order (docs/interface.md).

The order matters: a triple's index is ``15 * capacity + 5 * gaze + awareness``. Actions are every combination of the
strategies' levels; the last strategy varies first.
"""

from __future__ import annotations

from itertools import product
from typing import Literal, NamedTuple, get_args

CapacityClass = Literal["low", "high"]
GazeClass = Literal["distracted", "uncertain", "focused"]
AwarenessClass = Literal["unknown", "failure", "misconception_enabledness", "misconception_comprehension", "success"]
PolicySource = Literal["learner", "last_policy", "scoring", "override"]
LearnerName = Literal["scoring", "q-learning", "epsilon-greedy", "ucb1", "thompson", "linear-thompson", "planner"]

CAPACITIES: tuple[CapacityClass, ...] = get_args(CapacityClass)
GAZES: tuple[GazeClass, ...] = get_args(GazeClass)
AWARENESSES: tuple[AwarenessClass, ...] = get_args(AwarenessClass)

COGNITIVE_STATES: dict[tuple[str, ...], str] = {
    ("affirmation", "none"): "engaged_observer",
    ("negation_affirmation", "none"): "engaged_misinterpreter",
    ("negation", "none"): "distracted_misinterpreter",
    ("affirmation", "hesitation"): "overwhelmed_struggler",
    ("negation_affirmation", "hesitation"): "unfocused",
    ("negation", "hesitation"): "uncertain",
}
"""The paper's six cognitive states; each *is* its action (paper, section III-C)."""


class Triple(NamedTuple):
    """One observation as the decider sees it: one of the paper's 30 monitoring states (section III-A)."""

    capacity: CapacityClass
    gaze: GazeClass
    awareness: AwarenessClass

    @property
    def number(self) -> int:
        """The index, 0..29: ``15 * capacity + 5 * gaze + awareness``."""
        return 15 * CAPACITIES.index(self.capacity) + 5 * GAZES.index(self.gaze) + AWARENESSES.index(self.awareness)

    @property
    def name(self) -> str:
        """The name in policies whose states are triples, such as ``high/focused/unknown``."""
        return "/".join(self)


TRIPLES: tuple[Triple, ...] = tuple(Triple(*t) for t in product(CAPACITIES, GAZES, AWARENESSES))


def cognitive_state_name(levels: tuple[str, ...]) -> str:
    """Return the name of the cognitive state whose action has these levels, one per strategy.

    The paper's six states have the paper's names. A study with other strategies has the levels joined with ``+``.
    """
    return COGNITIVE_STATES.get(levels, "+".join(levels))
