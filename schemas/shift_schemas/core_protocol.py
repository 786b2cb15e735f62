"""The protocol of a core: the fold ``step(state, message, now) -> Step`` and its two outcomes. Pure.

Cores import this module and nothing of the runtime. The runtime decodes, steps, commits and publishes. A core reads no
clock: the time is passed in as ``now``.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

from shift_schemas.messages import Fact, Seen

S = TypeVar("S")


@dataclass(frozen=True)
class Step(Generic[S]):
    """The result of one step: the next state, the facts to publish, and the answer to a command.

    The answer is one of the facts or a JSON object.
    """

    state: S
    facts: tuple[Fact, ...] = ()
    result: Fact | dict[str, Any] = field(default_factory=dict)
    repeat: bool = False
    """Whether ``result`` is that of an earlier, equal request."""


class InputsMissing(Exception):
    """A command cannot be answered before its owner has read more of its inputs.

    The runtime waits for the facts of ``owners``. After ``give_up_s`` it steps the command again with
    ``timed_out=True``; the core then answers with the inputs that it has, or raises an error. The owners in
    ``holding`` may hold back what is missing until they are asked, so they are asked at once.
    """

    def __init__(self, owners: tuple[str, ...], give_up_s: float, holding: tuple[str, ...] = ()) -> None:
        super().__init__(f"waiting for {', '.join(owners)}")
        self.owners = owners
        self.give_up_s = give_up_s
        self.holding = holding


def covers(seen: Seen, required: Seen) -> bool:
    """Return whether ``seen`` includes all that is ``required``."""
    return (
        seen.decision >= required.decision
        and seen.performance >= required.performance
        and seen.config >= required.config
        and seen.observation >= required.observation
        and seen.policy >= required.policy
        and covers_gaze(seen, required)
    )


def covers_gaze(seen: Seen, required: Seen) -> bool:
    """Return whether ``seen`` includes all chunks of gaze that are ``required``."""
    return all(seen.gaze.get(source, -1) >= seq for source, seq in required.gaze.items())
