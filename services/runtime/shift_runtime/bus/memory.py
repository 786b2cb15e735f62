"""The in-memory bus: the same handlers without a network, for tests of a whole mesh in one process."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeVar

from shift_runtime.bus.protocol import Handle, Incoming, Reply, Request

T = TypeVar("T")


def matches(expression: str, key: str) -> bool:
    """Return whether a key expression matches ``key``, as in Zenoh.

    ``*`` matches any one part and ``**`` at the end any rest, but neither matches a part that begins with ``@``.
    """
    parts, wanted = key.split("/"), expression.split("/")
    if wanted[-1] == "**":
        wanted = wanted[:-1] + ["*"] * (len(parts) - len(wanted) + 1)
    return len(parts) == len(wanted) and all(
        w == p or (w == "*" and not p.startswith("@")) for w, p in zip(wanted, parts, strict=True)
    )


@dataclass
class Hub:
    """The meeting point of the in-memory buses of one process."""

    subscribers: list[tuple[str, Callable[[Incoming], None]]] = field(default_factory=list)
    servers: list[tuple[str, Callable[[Request], None]]] = field(default_factory=list)
    tokens: set[str] = field(default_factory=set)


@dataclass
class _Request:
    key: str
    payload: bytes
    answered: asyncio.Future[Reply]

    def reply(self, payload: bytes) -> None:
        self._settle(Reply(True, payload))

    def refuse(self, payload: bytes) -> None:
        self._settle(Reply(False, payload))

    def _settle(self, reply: Reply) -> None:
        if not self.answered.done():
            self.answered.set_result(reply)


@dataclass
class _Handle:
    take_back: Callable[[], None]

    def close(self) -> None:
        self.take_back()


class MemoryBus:
    """One participant at a :class:`Hub`."""

    def __init__(self, hub: Hub) -> None:
        self._hub = hub
        self._handles: list[_Handle] = []
        self._dropped = 0

    def put(self, key: str, payload: bytes, *, encoding: str = "", attachment: bytes = b"") -> None:
        """See :class:`~shift_runtime.bus.protocol.Bus`."""
        for expression, handler in list(self._hub.subscribers):
            if matches(expression, key):
                handler(Incoming(key, payload, attachment))

    async def get(
        self, key: str, payload: bytes = b"", *, timeout_s: float, enough: Callable[[Reply], bool] | None = None
    ) -> list[Reply]:
        """See :class:`~shift_runtime.bus.protocol.Bus`."""
        waiting = []
        for expression, handler in list(self._hub.servers):
            if matches(expression, key) or matches(key, expression):
                future: asyncio.Future[Reply] = asyncio.get_running_loop().create_future()
                handler(_Request(key, payload, future))
                waiting.append(future)
        replies: list[Reply] = []
        with contextlib.suppress(TimeoutError):
            for coming in asyncio.as_completed(waiting, timeout=timeout_s):
                replies.append(await coming)
                if enough is not None and enough(replies[-1]):
                    break
        return replies

    def subscribe(self, key: str, handler: Callable[[Incoming], None], *, limit: int = 10_000) -> Handle:
        """See :class:`~shift_runtime.bus.protocol.Bus`."""
        entry = (key, self._later(handler, limit))
        self._hub.subscribers.append(entry)
        return self._held(lambda: self._hub.subscribers.remove(entry))

    def serve(self, key: str, handler: Callable[[Request], None], *, limit: int = 10_000) -> Handle:
        """See :class:`~shift_runtime.bus.protocol.Bus`."""
        entry = (key, self._later(handler, limit))
        self._hub.servers.append(entry)
        return self._held(lambda: self._hub.servers.remove(entry))

    def token(self, key: str) -> Handle:
        """See :class:`~shift_runtime.bus.protocol.Bus`."""
        self._hub.tokens.add(key)
        return self._held(lambda: self._hub.tokens.discard(key))

    async def reopen(self) -> None:
        """See :class:`~shift_runtime.bus.protocol.Bus`. This bus has no links that could be lost."""

    async def answers_by_router(self, key: str) -> bool:
        """See :class:`~shift_runtime.bus.protocol.Bus`. This bus has no router."""
        return False

    @property
    def joined(self) -> bool:
        """See :class:`~shift_runtime.bus.protocol.Bus`."""
        return True

    @property
    def dropped(self) -> int:
        """See :class:`~shift_runtime.bus.protocol.Bus`."""
        return self._dropped

    async def close(self) -> None:
        """See :class:`~shift_runtime.bus.protocol.Bus`."""
        while self._handles:
            self._handles[-1].close()

    def _held(self, take_back: Callable[[], None]) -> Handle:
        handle = _Handle(lambda: None)

        def close() -> None:
            if handle in self._handles:
                self._handles.remove(handle)
                take_back()

        handle.take_back = close
        self._handles.append(handle)
        return handle

    def _later(self, handler: Callable[[T], None], limit: int) -> Callable[[T], None]:
        """Return a function that lets the loop run the handler later, as a network does."""
        loop = asyncio.get_running_loop()
        waiting = 0

        def run(item: T) -> None:
            nonlocal waiting
            waiting -= 1
            handler(item)

        def enqueue(item: T) -> None:
            nonlocal waiting
            if waiting >= limit:
                self._dropped += 1
                return
            waiting += 1
            loop.call_soon(run, item)

        return enqueue
