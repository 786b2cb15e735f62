"""Helpers of the runtime's tests: endpoints, waiting, and facts to read."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable, Callable
from typing import Any

from shift_runtime.bus.protocol import Bus
from shift_schemas.messages import Marker, OutboxRow
from shift_schemas.timestamps import Stamp

from support.free_ports import free_port

SOON_S = 10.0
"""A test that waits so long has failed."""


def free_endpoint() -> str:
    """Return an endpoint on which nobody listens."""
    return f"tcp/127.0.0.1:{free_port()}"


async def until(there: Callable[[], Any]) -> None:
    """Wait until ``there()`` is true."""
    async with asyncio.timeout(SOON_S):
        while not there():  # noqa: ASYNC110
            await asyncio.sleep(0.005)


async def until_asked(ask: Callable[[], Awaitable[Any]]) -> None:
    """Wait until ``ask()`` returns something true; a declaration needs time to reach everybody."""
    async with asyncio.timeout(SOON_S):
        while not await ask():  # noqa: ASYNC110
            await asyncio.sleep(0.01)


async def linked(*buses: Bus) -> None:
    """Wait until every bus receives the publications of every other."""
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
    """Return the ``n``-th marker."""
    return Marker(session=session, stamp=Stamp.of(n), marker_id=f"m{n}", text=text or f"note {n}")


def row(n: int, session: str = "s1", text: str = "") -> OutboxRow:
    """Return the ``n``-th marker as a row of its owner's outbox."""
    return OutboxRow(session=session, seq=n, subject="marker", payload=marker(n, session, text).model_dump_json())


def loads(payload: bytes) -> Any:
    """Return a JSON payload's value."""
    return json.loads(payload)
