"""What the bridge and its backends share: their protocols, the base of both backends, and the inbox.

Both backends declare the same table of interfaces, and they pass messages on in their order of arrival. The inbox
leads from a backend's thread into the bridge's loop.
"""

from __future__ import annotations

import asyncio
import threading
from collections import Counter, deque
from collections.abc import Callable, Coroutine
from typing import Any, Protocol

import structlog
from shift_schemas.errors import ShiftError, Unavailable

from shift_ros2.mapping import text_of_error

log = structlog.get_logger()
Answer = tuple[bool, str]
"""``success`` and ``message`` of the service."""
TURN = 200
"""Arrivals that are handled before other tasks of the loop run."""
WAITING = 2_000
"""Arrivals of one topic that may wait; more are dropped and counted."""


class Backend(Protocol):
    """One node in a ROS graph."""

    def publish(self, topic: str, text: str) -> None:
        """Publish a text on one of the interfaces."""

    @property
    def state(self) -> str:
        """What the backend waits for, or an empty text."""

    async def close(self) -> None:
        """Leave the graph."""


async def answer_of(handlers: Handlers, request_id: str | None) -> Answer:
    """Return the bridge's answer, or that it stops if it is cancelled before it has one."""
    try:
        return await handlers.on_request(request_id)
    except asyncio.CancelledError:
        return unavailable_answer()


def unavailable_answer() -> Answer:
    """Return the answer to a request that cannot be handled now."""
    return False, text_of_error(Unavailable("the bridge is busy or stopping; ask again"))


class Handlers(Protocol):
    """What a backend calls in the bridge; always in the bridge's loop."""

    def on_text(self, topic: str, text: str) -> None:
        """Handle a message. Raise :class:`ShiftError`."""

    async def on_request(self, request_id: str | None) -> Answer:
        """Return the answer to a request for the next strategy."""

    def on_tracked(self, persons: list[str]) -> None:
        """Handle the list of tracked persons (ROS4HRI)."""

    def on_engagement(self, person: str, level: int) -> None:
        """Handle a person's engagement level (ROS4HRI)."""

    def on_lost(self, topic: str, error: ShiftError, count: int = 1, reason: str = "") -> None:
        """Count messages that could not be read or had no room."""


class Inbox:
    """Takes arrivals in any thread and handles them in the loop, in their order of arrival.

    A burst wakes the loop once and not once for each message, so that a flood costs the loop only the handling.
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
        """Add an arrival, in any thread; return whether there was room."""
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
            except RuntimeError:  # the loop is closed: the process ends
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
            except Exception:  # the bridge continues, and the other arrivals of this turn are not lost
                log.exception("an arrival failed", topic=topic)
        for topic, number in lost.items():
            self._overflowed(topic, number)
        if again:
            self._loop.call_soon(self._turn)


class BackendBase:
    """What both backends do alike: the inbox, the tasks that answer requests, and reports of lost messages."""

    def __init__(self, handlers: Handlers) -> None:
        self._handlers = handlers
        self._inbox = Inbox(self._on_overflow)
        self._answering: set[asyncio.Task[None]] = set()

    def _start_answer(self, answer: Coroutine[Any, Any, None]) -> None:
        """Answer a request in a task of its own."""
        task = asyncio.get_running_loop().create_task(answer)
        self._answering.add(task)
        task.add_done_callback(self._answering.discard)

    async def _stop_answers(self) -> None:
        """Cancel the tasks that answer requests, and wait until each has sent its answer."""
        tasks = self._answering.copy()
        for task in tasks:
            task.cancel()
        if tasks:
            await asyncio.wait(tasks)

    def _handle(self, topic: str, handle: Callable[[], None]) -> None:
        """Call ``handle``; a message that it refuses is counted as lost."""
        try:
            handle()
        except ShiftError as e:
            self._handlers.on_lost(topic, e)

    def _on_overflow(self, topic: str, number: int) -> None:
        error = ShiftError("messages came faster than the bridge could read them; some were dropped")
        self._handlers.on_lost(topic, error, number, reason="overload")
