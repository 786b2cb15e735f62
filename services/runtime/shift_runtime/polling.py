"""Waiting for a condition that can only be asked for, with a deadline."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable


async def poll(ready: Callable[[], Awaitable[bool]], *, timeout_s: float, pause_s: float) -> bool:
    """Ask ``ready`` until it is true or ``timeout_s`` is over; return whether it became true.

    It is asked at least once and never interrupted, so that what it found last explains a timeout. ``pause_s`` is the
    time between two questions.
    """
    loop = asyncio.get_running_loop()
    deadline = loop.time() + timeout_s
    while not await ready():
        if loop.time() > deadline:
            return False
        await asyncio.sleep(pause_s)
    return True
