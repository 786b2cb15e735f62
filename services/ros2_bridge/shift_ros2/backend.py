"""What a backend gives the bridge, and the way from a backend's thread into the bridge's loop.

Both backends declare the same table of interfaces and hand over what arrives in its order of arrival.
"""

from __future__ import annotations

import asyncio
import threading
from collections import Counter, deque
from collections.abc import Callable, Collection
from typing import Protocol

import structlog
from shift_schemas.errors import ShiftError, Unavailable

from shift_ros2.mapping import text_of_error

log = structlog.get_logger()
Answer = tuple[bool, str]
"""``success`` and ``message`` of the service."""
TURN = 200
"""Arrivals that are handled before others of the loop have their turn."""
WAITING = 2_000
"""Arrivals of one topic that may wait; more are dropped and counted."""


class Backend(Protocol):
    """One node in a ROS graph."""

    def publish(self, topic: str, text: str) -> None:
        """Put a text out under one of the interfaces."""

    @property
    def state(self) -> str:
        """Empty, or what the backend waits for."""

    async def close(self) -> None:
        """Leave the graph."""


async def answer_of(handlers: Handlers, request_id: str | None) -> Answer:
    """What the bridge answers; that it stops, where it does so before it knows."""
    try:
        return await handlers.on_request(request_id)
    except asyncio.CancelledError:
        return away()


def away() -> Answer:
    """The answer to a request that nobody has time for."""
    return False, text_of_error(Unavailable("the bridge is busy or stopping; ask again"))


async def stopped(tasks: Collection[asyncio.Task[None]]) -> None:
    """Cancel them, and wait until they have said so."""
    for task in tasks:
        task.cancel()
    if tasks:
        await asyncio.wait(tasks)


class Handlers(Protocol):
    """What a backend tells the bridge; all in the bridge's loop."""

    def on_text(self, topic: str, text: str) -> None:
        """A message came."""

    async def on_request(self, request_id: str | None) -> Answer:
        """Somebody asks for the next strategy."""

    def on_tracked(self, persons: list[str]) -> None:
        """ROS4HRI: who is tracked."""

    def on_engagement(self, person: str, level: int) -> None:
        """ROS4HRI: how engaged somebody is."""

    def on_lost(self, topic: str, error: ShiftError, count: int = 1, reason: str = "") -> None:
        """Something could not be read, or there was no room for it."""


class Inbox:
    """Takes arrivals in any thread and runs them in the loop, first come, first served.

    One wake-up of the loop for a burst, not one for each: a flood costs the loop its handling and no more.
    """

    def __init__(self, overflowed: Callable[[str, int], None]) -> None:
        self._loop = asyncio.get_running_loop()
        self._overflowed = overflowed
        self._lock = threading.Lock()
        self._items: deque[tuple[str, Callable[[], None]]] = deque()
        self._waiting: Counter[str] = Counter()
        self._lost: Counter[str] = Counter()
        self._awake = False

    def put(self, topic: str, handle: Callable[[], None]) -> bool:
        """From any thread; whether there was room."""
        with self._lock:
            room = self._waiting[topic] < WAITING
            if room:
                self._waiting[topic] += 1
                self._items.append((topic, handle))
            else:
                self._lost[topic] += 1
            wake, self._awake = not self._awake, True
        if wake:
            try:
                self._loop.call_soon_threadsafe(self._turn)
            except RuntimeError:  # the loop is closed: the process is going
                return False
        return room

    def _turn(self) -> None:
        with self._lock:
            count = min(TURN, len(self._items))
            items = [self._items.popleft() for _ in range(count)]
            self._waiting.subtract(topic for topic, _ in items)
            lost, self._lost = self._lost, Counter()
            self._awake = bool(self._items)
            again = self._awake
        for topic, handle in items:
            try:
                handle()
            except Exception:  # ours; the bridge lives on, and the others of this turn are not lost
                log.exception("an arrival failed", topic=topic)
        for topic, number in lost.items():
            self._overflowed(topic, number)
        if again:
            self._loop.call_soon(self._turn)
