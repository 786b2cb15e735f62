"""A service's own endpoints: its outbox, its health and its metrics."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest
from shift_runtime.service import disk_alarm as disk_alarm_module
from shift_schemas.codec import decode, encode
from shift_schemas.errors import Unavailable
from shift_schemas.messages import OutboxPage, OutboxQuery
from support.runtime_fixtures import until
from support.worker_rig import Rig, fixation

pytestmark = pytest.mark.anyio


async def test_health_reports_a_full_disk_and_recovers_by_itself(live: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(disk_alarm_module, "CHECK_EVERY_S", 0.02)
    live.journal.full = True
    with pytest.raises(Unavailable):
        await live.decide("d1")
    health = await live.health()
    assert not health.ready
    assert "the disk is full" in health.detail
    await asyncio.sleep(0.06)
    assert not (await live.health()).ready
    live.journal.full = False
    await until(lambda: live.worker.ready)
    assert (await live.health()).detail == ""


async def test_health_names_owners_whose_journals_were_not_read_yet(tmp_path: Path) -> None:
    rig = Rig(tmp_path / "decider.sqlite")
    rig.recorder.die()
    rig.monitor.die()
    rig.start()
    health = await rig.health()
    assert not health.ready
    assert health.detail == "waits for the monitor, the recorder"
    rig.recorder.live()
    rig.monitor.live()
    await rig.ready()
    assert (await rig.health()).ready
    await rig.stop()


@pytest.mark.parametrize("payload", [b"", b"{]", b'{"limit": 0}', b'{"cursors": {"*": 1}}', b'{"limit": true}'])
async def test_malformed_outbox_query_is_counted_and_refused(live: Rig, payload: bytes) -> None:
    (reply,) = await live.ask("shift/v1/@service/decider/outbox", payload)
    assert not reply.ok
    assert await live.dropped("malformed") == 1


async def test_outbox_holds_what_was_committed(live: Rig) -> None:
    live.monitor.publish(fixation(1))
    await until(lambda: live.outbox())
    (reply,) = await live.ask("shift/v1/@service/decider/outbox", encode(OutboxQuery(only=["s1"])))
    page = decode(OutboxPage, reply.payload)
    assert [(r.seq, r.subject) for r in page.rows] == [(1, "override")]
    assert page.heads == {"s1": 1}
    assert page.cursors == {"s1": {"recorder": 2, "monitor": 1}}


async def test_metrics_count_sessions_facts_and_commands(live: Rig) -> None:
    live.monitor.publish(fixation(1))
    await until(lambda: live.outbox())
    await live.decide("d1")
    await until(lambda: len(live.published) == 2)
    (reply,) = await live.ask("shift/v1/@service/decider/metrics", b"")
    lines = reply.payload.decode().splitlines()
    for line in (
        'shift_sessions{service="decider"} 1.0',
        'shift_facts_read_total{service="decider",subject="fixation"} 1.0',
        'shift_facts_published_total{service="decider",subject="override"} 2.0',
        'shift_commands_total{outcome="done",procedure="decide",service="decider"} 1.0',
    ):
        assert line in lines
