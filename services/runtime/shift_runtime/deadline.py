"""Deadlines on the clock of the running event loop."""

from __future__ import annotations

import asyncio


class Deadline:
    """A point in time: ``wait_s`` seconds from now, on the clock of the running event loop."""

    def __init__(self, wait_s: float) -> None:
        self._loop = asyncio.get_running_loop()
        self._end = self._loop.time() + wait_s

    @property
    def left_s(self) -> float:
        """Seconds until the deadline, 0 after it."""
        return max(0.0, self._end - self._loop.time())

    async def is_set(self, event: asyncio.Event) -> bool:
        """Wait until ``event`` is set, at most until the deadline. Return whether it was set."""
        try:
            async with asyncio.timeout_at(self._end):
                await event.wait()
        except TimeoutError:
            return False
        return True
