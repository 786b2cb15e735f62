"""Commands that nobody waits for: performances and markers, one after the other, until they are acknowledged."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Awaitable, Callable
from typing import Any

import structlog
from shift_schemas.errors import ShiftError, Unavailable

from shift_ros2.completion import Progress

log = structlog.get_logger()
Work = Callable[[], Awaitable[Any]]
WAITING = 1_000
PAUSE_S = 0.2


class Reports:
    """A service that is away is asked again until it is back; a refusal is told and done with."""

    def __init__(self, lost: Callable[[str, ShiftError], None]) -> None:
        self._lost = lost
        self._waiting: deque[tuple[str, Work]] = deque()
        self._wake = asyncio.Event()
        self._progress = Progress()

    def put(self, topic: str, work: Work) -> None:
        """Hand it on in its turn. Raises :class:`Unavailable` where too many wait."""
        if len(self._waiting) >= WAITING:
            raise Unavailable(f"{WAITING} messages already wait to be forwarded; this one was dropped")
        self._progress.came()
        self._waiting.append((topic, work))
        self._wake.set()

    async def run(self) -> None:
        """Hand on for ever."""
        while True:
            if not self._waiting:
                self._wake.clear()
                await self._wake.wait()
            topic, work = self._waiting[0]
            await self._carry_out(topic, work)
            self._waiting.popleft()
            self._progress.done()

    async def passed(self, wait_s: float) -> bool:
        """Wait for what has arrived by now; whether it is handed on."""
        return await self._progress.passed(wait_s)

    async def _carry_out(self, topic: str, work: Work) -> None:
        told = False
        while True:
            try:
                await work()
                return
            except Unavailable as e:
                if not told:
                    self._lost(topic, e)
                told = True
                await asyncio.sleep(PAUSE_S)
            except ShiftError as e:
                self._lost(topic, e)
                return
            except Exception:
                log.exception("a message could not be handed on", topic=topic)
                self._lost(topic, ShiftError("something went wrong inside the bridge; see its log"))
                return
