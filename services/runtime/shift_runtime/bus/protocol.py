"""The bus: the interface that every transport implements.

Handlers run in the event loop that opened the bus, one at a time. A publication is a notification: it may be lost, and
the reader of a journal works without it. A request returns the replies that came within its time; an empty list means
that no server exists.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, TypeVar

T = TypeVar("T")


@dataclass(frozen=True)
class Incoming:
    """A publication as it arrived, unchecked."""

    key: str
    payload: bytes
    attachment: bytes


@dataclass(frozen=True)
class Reply:
    """One reply to a request: an answer or a refusal."""

    ok: bool
    payload: bytes


class Request(Protocol):
    """A request that waits for a reply; only the first of ``reply`` and ``refuse`` counts."""

    @property
    def key(self) -> str:
        """The key under which it was sent."""

    @property
    def payload(self) -> bytes:
        """The payload as it arrived, unchecked."""

    def reply(self, payload: bytes) -> None:
        """Answer with a result."""

    def refuse(self, payload: bytes) -> None:
        """Answer with an error."""


class Handle(Protocol):
    """A declaration on the bus."""

    def close(self) -> None:
        """Withdraw the declaration."""


class Bus(Protocol):
    """A transport."""

    def put(self, key: str, payload: bytes, *, encoding: str = "", attachment: bytes = b"") -> None:
        """Publish a message. It never blocks: where a subscriber is slow, the message is dropped."""

    async def get(
        self, key: str, payload: bytes = b"", *, timeout_s: float, enough: Callable[[Reply], bool] | None = None
    ) -> list[Reply]:
        """Send a request; return the replies within ``timeout_s`` seconds, up to the first that is ``enough``."""

    def subscribe(self, key: str, handler: Callable[[Incoming], None], *, limit: int = 10_000) -> Handle:
        """Receive what is published under ``key``, where ``*`` matches any one part.

        Messages are dropped and counted while ``limit`` of them wait for the handler.
        """

    def serve(self, key: str, handler: Callable[[Request], None], *, limit: int = 10_000) -> Handle:
        """Receive requests under ``key``. Requests are dropped and counted while ``limit`` of them wait."""

    def token(self, key: str) -> Handle:
        """Declare a token that exists as long as this process."""

    async def reopen(self) -> None:
        """Leave and join again with everything that was declared, so that lost links are made again.

        Requests that are under way may get no reply; their senders repeat them.
        """

    async def answers_by_router(self, key: str) -> bool:
        """Return whether a server under ``key`` answers a client that is linked to the router only."""

    @property
    def joined(self) -> bool:
        """Whether a link to the router or to another process exists."""

    @property
    def dropped(self) -> int:
        """The number of messages and requests that were dropped because too many were waiting."""

    async def close(self) -> None:
        """Withdraw every declaration and leave."""


async def first_answer(
    bus: Bus, key: str, payload: bytes = b"", *, timeout_s: float, read: Callable[[Reply], T | None]
) -> T | None:
    """Send a request; return what ``read`` returns for the first reply that it can read, without waiting for others."""
    found: T | None = None

    def enough(reply: Reply) -> bool:
        nonlocal found
        found = read(reply)
        return found is not None

    await bus.get(key, payload, timeout_s=timeout_s, enough=enough)
    return found
