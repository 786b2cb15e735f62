"""What a core gives back: the fold ``step(state, message) -> (state, facts)`` in one small type.

Pure. Cores import this and nothing of the runtime; the runtime's shell decodes, steps, commits and
publishes. Time is passed in as ``now``.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

from shift_schemas.messages import Fact, Seen

S = TypeVar("S")


@dataclass(frozen=True)
class Step(Generic[S]):
    """The next state, the facts that follow, and a command's answer: one of them or an object."""

    state: S
    facts: tuple[Fact, ...] = ()
    result: Fact | dict[str, Any] = field(default_factory=dict)
    repeat: bool = False
    """Whether ``result`` is that of an earlier, equal request."""


class NotYet(Exception):
    """A command cannot be answered before its owner has read more of its inputs.

    ``owners`` are those it waits for; after ``give_up_s`` the shell asks again with ``late=True``, and
    the core then answers with what it has or raises what is the case.
    """

    def __init__(self, owners: tuple[str, ...], give_up_s: float) -> None:
        super().__init__(f"waiting for {', '.join(owners)}")
        self.owners = owners
        self.give_up_s = give_up_s


def covers(seen: Seen, need: Seen) -> bool:
    """Whether what was ``seen`` is all that is ``need``-ed."""
    return (
        seen.decision >= need.decision
        and seen.performance >= need.performance
        and seen.config >= need.config
        and seen.observation >= need.observation
        and seen.policy >= need.policy
        and covers_gaze(seen, need)
    )


def covers_gaze(seen: Seen, need: Seen) -> bool:
    """Whether all chunks of gaze were ``seen`` that are ``need``-ed."""
    return all(seen.gaze.get(source, -1) >= seq for source, seq in need.gaze.items())
