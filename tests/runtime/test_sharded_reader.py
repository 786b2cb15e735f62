"""The sharded reader: each session is read from its own shard, and an owner counts as read once every shard's was."""

from __future__ import annotations

from collections.abc import AsyncIterator

import pytest
from shift_runtime.bus.memory import Hub, MemoryBus
from shift_runtime.reader import ReadFact
from shift_runtime.sharded_reader import ShardedReader
from shift_schemas.shards import shard_of
from support.outbox_owner import Owner

pytestmark = pytest.mark.anyio

SESSIONS = ("s1", "s2", "s3", "s4", "s5")
Rig = tuple[ShardedReader, list[Owner], list[ReadFact]]


@pytest.fixture
async def rig() -> AsyncIterator[Rig]:
    """Yield a reader of two shards, the recorder of each, and what was read."""
    hubs, read = [Hub(), Hub()], list[ReadFact]()
    buses = [MemoryBus(hub) for hub in hubs]
    reader = ShardedReader(buses, ("recorder",), read.append, lambda reason: None, lambda owner: None)
    owners = [Owner(MemoryBus(hub), "recorder").live() for hub in hubs]
    for session in SESSIONS:
        owners[shard_of(session, 2)].commit(2, session)
    yield reader, owners, read
    for bus in buses:
        await bus.close()


async def test_sessions_of_these_tests_are_in_both_shards() -> None:
    assert {shard_of(session, 2) for session in SESSIONS} == {0, 1}


async def test_pull_of_an_owner_reads_every_shard(rig: Rig) -> None:
    reader, _, read = rig
    assert await reader.pull("recorder")
    assert sorted((r.fact.session, r.seq) for r in read) == [(s, n) for s in SESSIONS for n in (1, 2)]
    assert {session: reader.cursor(session, "recorder") for session in SESSIONS} == dict.fromkeys(SESSIONS, 2)


async def test_pull_of_a_session_asks_its_shard_alone(rig: Rig) -> None:
    reader, owners, read = rig
    assert await reader.pull("recorder", "s1")
    assert {r.fact.session for r in read} == {"s1"}
    assert [len(owner.asked) for owner in owners] == [int(shard_of("s1", 2) == n) for n in (0, 1)]
    assert reader.cursor("s2", "recorder") is None


async def test_owner_is_read_once_every_shard_was(rig: Rig) -> None:
    reader, owners, _ = rig
    owners[1].die()
    assert await reader.pull_all(("recorder",)) == ("recorder",)
    assert reader.synced == set()
    owners[1].live()
    assert await reader.pull_all(("recorder",)) == ()
    assert reader.synced == {"recorder"}


async def test_fact_is_read_again_from_its_own_shard(rig: Rig) -> None:
    reader, _, read = rig
    await reader.pull("recorder")
    first = next(r for r in read if r.fact.session == "s3" and r.seq == 2)
    read.clear()
    reader.read_again(first)
    await reader.pull("recorder")
    assert [(r.fact.session, r.seq) for r in read] == [("s3", 2)]
