"""How far a queue has come, so that a request can wait for what arrived before it."""

from __future__ import annotations

import asyncio

from shift_runtime.deadline import Deadline


class Completion:
    """Counts what a queue received and what it finished."""

    def __init__(self) -> None:
        self._received = 0
        self._finished = 0
        self._changed = asyncio.Event()

    def receive(self) -> None:
        """Count one more item."""
        self._received += 1

    def finish(self, count: int = 1) -> None:
        """Count ``count`` items as finished."""
        self._finished += count
        self._changed.set()

    @property
    def idle(self) -> bool:
        """Whether nothing waits."""
        return self._finished >= self._received

    async def wait(self, timeout_s: float) -> bool:
        """Wait until everything that was received before this call is finished.

        Returns whether it is, after ``timeout_s`` seconds at most.
        """
        mark, deadline = self._received, Deadline(timeout_s)
        while self._finished < mark:
            self._changed.clear()
            if not await deadline.is_set(self._changed):
                return False
        return True
