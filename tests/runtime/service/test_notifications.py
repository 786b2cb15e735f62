"""Notifications: facts are published in their order, at once or a little after the reply."""

from __future__ import annotations

import asyncio

import pytest
from shift_runtime.bus.memory import Hub, MemoryBus
from shift_runtime.metrics import Metrics
from shift_runtime.service import notifications as module
from shift_runtime.service.notifications import Notifications
from support.runtime_fixtures import row, until

pytestmark = pytest.mark.anyio


class Published:
    """Notifications on a bus, and what a subscriber hears."""

    def __init__(self) -> None:
        hub = Hub()
        self.heard: list[tuple[str, bytes, bytes]] = []
        MemoryBus(hub).subscribe("shift/v1/**", lambda m: self.heard.append((m.key, m.attachment, m.payload)))
        self.metrics = Metrics("recorder")
        self.notifications = Notifications(MemoryBus(hub), self.metrics)

    async def numbers(self) -> list[int]:
        await asyncio.sleep(0)
        return [int(attachment) for _, attachment, _ in self.heard]


@pytest.fixture
def slow(monkeypatch: pytest.MonkeyPatch) -> None:
    """What waits is published only when it is flushed."""
    monkeypatch.setattr(module, "NOTIFY_AFTER_S", 60.0)


async def test_fact_is_published_under_its_key_with_its_number() -> None:
    published = Published()
    published.notifications.notify([row(7)], later=False)
    await asyncio.sleep(0)
    assert published.heard == [("shift/v1/s1/marker", b"7", row(7).payload.encode())]
    assert b'shift_facts_published_total{service="recorder",subject="marker"} 1.0' in published.metrics.text()


async def test_facts_that_belong_to_a_reply_are_published_a_little_later() -> None:
    published = Published()
    published.notifications.notify([row(1), row(2)], later=True)
    assert await published.numbers() == []
    await until(lambda: published.heard)
    assert await published.numbers() == [1, 2]


@pytest.mark.usefixtures("slow")
async def test_later_facts_never_overtake_those_that_wait() -> None:
    published = Published()
    published.notifications.notify([row(1)], later=True)
    published.notifications.notify([row(2)], later=False)
    assert await published.numbers() == []
    published.notifications.flush()
    assert await published.numbers() == [1, 2]


@pytest.mark.usefixtures("slow")
async def test_flush_publishes_everything_once() -> None:
    published = Published()
    published.notifications.notify([row(1)], later=True)
    for _ in range(2):
        published.notifications.flush()
    published.notifications.notify([], later=True)
    published.notifications.notify([row(2)], later=False)
    assert await published.numbers() == [1, 2]
