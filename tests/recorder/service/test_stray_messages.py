"""Stray messages: what nobody subscribes to is counted; facts and stream chunks are not."""

from __future__ import annotations

import asyncio

import pytest
from shift_recorder.service.stray_messages import StrayMessages
from shift_runtime.bus.memory import Hub, MemoryBus
from shift_runtime.metrics import Metrics

pytestmark = pytest.mark.anyio


@pytest.mark.parametrize(
    ("key", "count"),
    [
        ("shift/v1/s1/marker", 0),
        ("shift/v1/s1/in/gaze", 0),
        ("shift/v1/s1/rpc/decide", 1),
        ("shift/v1/s1/nonsense", 1),
        ("shift/v1/s1/marker/more", 1),
        ("shift/v1/@service/decider/outbox", 1),
        ("other/v1/s1/nonsense", 0),
    ],
)
async def test_only_stray_messages_are_counted(key: str, count: int) -> None:
    hub, metrics = Hub(), Metrics("recorder")
    StrayMessages(MemoryBus(hub), metrics).declare()
    MemoryBus(hub).put(key, b"")
    await asyncio.sleep(0)
    assert f'shift_messages_dropped_total{{reason="malformed",service="recorder"}} {count}.0' in metrics.text().decode()
