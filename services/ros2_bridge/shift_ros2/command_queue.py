"""A queue of commands that nobody waits for, performances and markers; each is repeated until it is acknowledged."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Awaitable, Callable
from typing import Any

import structlog
from shift_schemas.errors import ShiftError, Unavailable
from shift_sources.completion import Completion

log = structlog.get_logger()
Command = Callable[[], Awaitable[Any]]
MOST_WAITING = 1_000
"""Chosen: commands that may wait; more are refused."""
RETRY_S = 0.2
"""Chosen: seconds until a service that does not answer is asked again."""


class CommandQueue:
    """Sends one command after the other. An unavailable service is asked again; a refusal is reported once."""

    def __init__(self, on_lost: Callable[[str, ShiftError], None]) -> None:
        self._on_lost = on_lost
        self._waiting: deque[tuple[str, Command]] = deque()
        self._wake = asyncio.Event()
        self._completion = Completion()

    def put(self, topic: str, command: Command) -> None:
        """Append a command. Raise :class:`Unavailable` if too many wait."""
        if len(self._waiting) >= MOST_WAITING:
            raise Unavailable(f"{MOST_WAITING} messages already wait to be forwarded; this one was dropped")
        self._completion.receive()
        self._waiting.append((topic, command))
        self._wake.set()

    async def run(self) -> None:
        """Send commands until cancelled."""
        while True:
            if not self._waiting:
                self._wake.clear()
                await self._wake.wait()
            topic, command = self._waiting[0]
            await self._send(topic, command)
            self._waiting.popleft()
            self._completion.finish()

    async def flush(self, timeout_s: float) -> bool:
        """Wait for what has arrived; return whether it was sent, after ``timeout_s`` seconds at most."""
        return await self._completion.wait(timeout_s)

    async def _send(self, topic: str, command: Command) -> None:
        reported = False
        while True:
            try:
                await command()
                return
            except Unavailable as e:
                if not reported:
                    self._on_lost(topic, e)
                reported = True
                await asyncio.sleep(RETRY_S)
            except ShiftError as e:
                self._on_lost(topic, e)
                return
            except Exception:
                log.exception("a message could not be forwarded", topic=topic)
                self._on_lost(topic, ShiftError("something went wrong inside the bridge; see its log"))
                return
