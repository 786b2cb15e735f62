"""How far a queue has come, so that a request can wait for what arrived before it."""

from __future__ import annotations

import asyncio


class Progress:
    """Counts what arrived and what is done with."""

    def __init__(self) -> None:
        self._arrived = 0
        self._handled = 0
        self._moved = asyncio.Event()

    def came(self) -> None:
        """One more has arrived."""
        self._arrived += 1

    def done(self, count: int = 1) -> None:
        """``count`` more are done with."""
        self._handled += count
        self._moved.set()

    @property
    def quiet(self) -> bool:
        """Whether nothing waits."""
        return self._handled >= self._arrived

    async def passed(self, wait_s: float) -> bool:
        """Wait until what has arrived by now is done with, ``wait_s`` at most; whether it is."""
        mark = self._arrived
        loop = asyncio.get_running_loop()
        until = loop.time() + wait_s
        while self._handled < mark:
            self._moved.clear()
            try:
                await asyncio.wait_for(self._moved.wait(), until - loop.time())
            except TimeoutError:
                return False
        return True
