"""The bus: what every transport gives, and nothing of any one transport.

Handlers run in the event loop that opened the bus, one at a time. A publication is a hint: it may be
lost, and the journal's reader does without it. A request gets the replies that came within its time;
an empty list means that nobody is there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, TypeVar

T = TypeVar("T")


@dataclass(frozen=True)
class Incoming:
    """A publication as it arrived. Nothing about it has been checked."""

    key: str
    payload: bytes
    attachment: bytes


@dataclass(frozen=True)
class Reply:
    """One reply to a request: an answer, or a refusal."""

    ok: bool
    payload: bytes


class Request(Protocol):
    """A request that waits for a reply; only the first of ``reply`` and ``refuse`` counts."""

    @property
    def key(self) -> str:
        """The key that was asked."""

    @property
    def payload(self) -> bytes:
        """What was sent along; nothing about it has been checked."""

    def reply(self, payload: bytes) -> None:
        """Answer."""

    def refuse(self, payload: bytes) -> None:
        """Answer with an error."""


class Handle(Protocol):
    """Something declared on the bus."""

    def close(self) -> None:
        """Take it back."""


class Bus(Protocol):
    """A transport."""

    def put(self, key: str, payload: bytes, *, encoding: str = "", attachment: bytes = b"") -> None:
        """Publish; never blocks, and drops rather than wait for a slow subscriber."""

    async def get(
        self, key: str, payload: bytes = b"", *, timeout_s: float, enough: Callable[[Reply], bool] | None = None
    ) -> list[Reply]:
        """Ask; every reply that came within ``timeout_s``, up to the first that is ``enough``."""

    def subscribe(self, key: str, handler: Callable[[Incoming], None], *, limit: int = 10_000) -> Handle:
        """Hear what is published under ``key`` (``*`` is any one part); beyond ``limit`` waiting, it is dropped."""

    def serve(self, key: str, handler: Callable[[Request], None], *, limit: int = 10_000) -> Handle:
        """Be asked under ``key``."""

    def token(self, key: str) -> Handle:
        """Show that this process is alive, for as long as it is."""

    async def reopen(self) -> None:
        """Leave and join again, with all that was declared: links that are gone are made anew.

        Requests that are under way may get no answer; whoever asked asks again.
        """

    async def answers_by_router(self, key: str) -> bool:
        """Return whether somebody answers under ``key`` to one who is linked to the router only."""

    @property
    def joined(self) -> bool:
        """Whether there is any link, to the router or to another process."""

    @property
    def dropped(self) -> int:
        """How many arrivals were dropped because too many were waiting."""

    async def close(self) -> None:
        """Take everything back and leave."""


async def first_answer(
    bus: Bus, key: str, payload: bytes = b"", *, timeout_s: float, read: Callable[[Reply], T | None]
) -> T | None:
    """Ask; what ``read`` makes of the first reply that it can make something of, without waiting for others."""
    found: T | None = None

    def enough(reply: Reply) -> bool:
        nonlocal found
        found = read(reply)
        return found is not None

    await bus.get(key, payload, timeout_s=timeout_s, enough=enough)
    return found
