"""What the tests of the runtime share: endpoints, waiting, facts to read, a core small enough to check by hand."""

from __future__ import annotations

import asyncio
import json
import socket
from collections.abc import Awaitable, Callable
from typing import Any

from shift_runtime.bus.protocol import Bus
from shift_schemas.messages import Marker, OutboxRow
from shift_schemas.timestamps import Stamp

SOON_S = 10.0
"""Nothing here takes that long; a test that waits so long has failed."""


def free_endpoint() -> str:
    """An endpoint that nobody listens on now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"


async def until(there: Callable[[], Any]) -> None:
    """Wait until ``there()``."""
    async with asyncio.timeout(SOON_S):
        while not there():  # noqa: ASYNC110
            await asyncio.sleep(0.005)


async def until_asked(ask: Callable[[], Awaitable[Any]]) -> None:
    """Wait until what is asked for is true: a declaration takes its time to get around."""
    async with asyncio.timeout(SOON_S):
        while not await ask():  # noqa: ASYNC110
            await asyncio.sleep(0.01)


async def linked(*buses: Bus) -> None:
    """Wait until each of the buses hears each of them."""
    heard: dict[str, set[str]] = {f"link/{i}": set() for i in range(len(buses))}
    handles = [bus.subscribe("link/*", lambda m, i=i: heard[f"link/{i}"].add(m.key)) for i, bus in enumerate(buses)]
    async with asyncio.timeout(SOON_S):
        while any(len(found) < len(buses) for found in heard.values()):
            for i, bus in enumerate(buses):
                bus.put(f"link/{i}", b"")
            await asyncio.sleep(0.01)
    for handle in handles:
        handle.close()


def marker(n: int, session: str = "s1", text: str = "") -> Marker:
    """The ``n``-th marker."""
    return Marker(session=session, stamp=Stamp.of(n), marker_id=f"m{n}", text=text or f"note {n}")


def row(n: int, session: str = "s1", text: str = "") -> OutboxRow:
    """The ``n``-th marker in its owner's outbox."""
    return OutboxRow(session=session, seq=n, subject="marker", payload=marker(n, session, text).model_dump_json())


def loads(payload: bytes) -> Any:
    """A JSON payload."""
    return json.loads(payload)
