"""The reader: it delivers exactly cursor + 1, whatever happens to notifications and to the owner."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from dataclasses import dataclass, field
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shift_runtime import reader as reader_module
from shift_runtime.bus.memory import Hub, MemoryBus
from shift_runtime.bus.protocol import Bus, Request
from shift_runtime.reader import Reader, ReadFact, fact_of
from shift_schemas.codec import encode
from shift_schemas.errors import MalformedMessage
from shift_schemas.keys import FactKey, ServiceKey, build_key
from shift_schemas.messages import OutboxPage, OutboxRow
from support.outbox_owner import Owner
from support.runtime_fixtures import marker, row, until

OUTBOX = build_key(ServiceKey("recorder", "outbox"))


def recorder(bus: Bus, most: int = 3) -> Owner:
    """Return an owner of sessions with pages of ``most`` rows."""
    return Owner(bus, "recorder", most)


@dataclass
class Reading:
    """A reader of one owner, and what it delivered."""

    bus: Bus
    cursors: dict[tuple[str, str], int] = field(default_factory=dict)
    done: set[str] = field(default_factory=set)
    found: list[ReadFact] = field(default_factory=list)
    dropped: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.reader = Reader(
            self.bus, ("recorder",), self.cursors, self.found.append, self.dropped.append, done=self.done
        )
        self.reader.start()

    def sequence(self, session: str = "s1") -> list[int]:
        return [read.seq for read in self.found if read.fact.session == session]


async def read_up() -> tuple[Owner, Reading]:
    bus = MemoryBus(Hub())
    return recorder(bus).live(), Reading(bus)


async def settled() -> None:
    for _ in range(10):
        await asyncio.sleep(0)


def run(work: Coroutine[Any, Any, None]) -> None:
    asyncio.run(work)


# --- notifications ---


def test_notifications_in_order_are_delivered_without_a_pull() -> None:
    async def test() -> None:
        owner, reading = await read_up()
        owner.commit(3)
        for n in (1, 2, 3):
            owner.notify(n)
        await settled()
        assert [(r.owner, r.seq, r.fact, r.payload) for r in reading.found] == [
            ("recorder", n, marker(n), marker(n).model_dump_json()) for n in (1, 2, 3)
        ]
        assert owner.asked == []

    run(test())


def test_gap_is_pulled_at_once() -> None:
    async def test() -> None:
        owner, reading = await read_up()
        owner.commit(8)
        owner.notify(1)
        owner.notify(8)
        await until(lambda: reading.sequence() == list(range(1, 9)))
        assert owner.asked[0].cursors == {"s1": 1}

    run(test())


def test_delivered_fact_is_not_delivered_again() -> None:
    async def test() -> None:
        owner, reading = await read_up()
        owner.commit(2)
        for n in (1, 1, 2, 1, 2, 2):
            owner.notify(n)
        await settled()
        await reading.reader.pull("recorder")
        assert reading.sequence() == [1, 2]

    run(test())


def test_pull_without_notifications_reads_page_by_page_to_the_end() -> None:
    async def test() -> None:
        owner, reading = await read_up()
        owner.commit(7)
        owner.commit(4, "s2")
        assert await reading.reader.pull("recorder")
        assert reading.sequence() == list(range(1, 8))
        assert reading.sequence("s2") == [1, 2, 3, 4]
        assert reading.reader.synced == {"recorder"}

    run(test())


def test_reader_continues_at_its_cursor() -> None:
    async def test() -> None:
        bus = MemoryBus(Hub())
        owner = recorder(bus).live()
        reading = Reading(bus, cursors={("s1", "recorder"): 4})
        owner.commit(6)
        await reading.reader.pull("recorder")
        assert reading.sequence() == [5, 6]

    run(test())


@pytest.mark.parametrize(
    ("key", "payload", "attachment"),
    [
        ("shift/v1/s1/marker", marker(1).model_dump_json().encode(), b""),
        ("shift/v1/s1/marker", marker(1).model_dump_json().encode(), b"one"),
        ("shift/v1/s1/marker", marker(1).model_dump_json().encode(), b"-1"),
        ("shift/v1/s1/marker", marker(1).model_dump_json().encode(), b"1" * 400),
        ("shift/v1/s1/marker", marker(1, "s2").model_dump_json().encode(), b"1"),
        ("shift/v1/s1/marker", b"", b"1"),
        ("shift/v1/s1/marker", b"\xff\xfe\x00", b"1"),
        ("shift/v1/s1/marker", b"[" * 100_000, b"1"),
        ("shift/v1/s1/marker", b'{"session": "s1"}', b"1"),
        ("shift/v1/s1/config", marker(1).model_dump_json().encode(), b"1"),
        ("shift/v1/*/marker", marker(1).model_dump_json().encode(), b"1"),
        ("shift/v1/-x/marker", marker(1).model_dump_json().encode(), b"1"),
    ],
)
def test_invalid_notification_is_counted_and_dropped(key: str, payload: bytes, attachment: bytes) -> None:
    async def test() -> None:
        owner, reading = await read_up()
        owner.commit(1)
        owner.bus.put(key, payload, attachment=attachment)
        await settled()
        assert reading.found == []
        assert reading.dropped == ["malformed"]
        owner.notify(1)
        await settled()
        assert reading.sequence() == [1]

    run(test())


def test_sequence_0_is_never_next() -> None:
    async def test() -> None:
        owner, reading = await read_up()
        owner.bus.put("shift/v1/s1/marker", marker(1).model_dump_json().encode(), attachment=b"0")
        await settled()
        assert reading.found == []

    run(test())


def test_forgotten_session_is_not_read_any_more() -> None:
    async def test() -> None:
        owner, reading = await read_up()
        owner.commit(2)
        owner.notify(1)
        await settled()
        reading.reader.forget("s1")
        owner.notify(2)
        await settled()
        assert await reading.reader.pull("recorder")
        assert reading.sequence() == [1]

    run(test())


# --- pulls ---


def test_absent_owner_gives_no_answer_and_nothing_is_lost() -> None:
    async def test() -> None:
        owner, reading = await read_up()
        owner.commit(2)
        owner.die()
        assert not await reading.reader.pull("recorder")
        assert await reading.reader.pull_all(("recorder", "monitor")) == ("recorder",)
        assert reading.reader.synced == set()
        owner.live()
        assert await reading.reader.pull_all(("recorder",)) == ()
        assert reading.sequence() == [1, 2]

    run(test())


def test_no_owner_is_synced_before_the_recorder() -> None:
    """Facts of an unknown session are deferred, so an owner that was read that early is not synced."""

    async def test() -> None:
        owner = recorder(MemoryBus(hub := Hub()))
        learner = MemoryBus(hub)
        page = OutboxPage(owner="learner", rows=[], heads={}, complete=True)
        learner.serve(build_key(ServiceKey("learner", "outbox")), lambda request: request.reply(encode(page)))
        reader = Reader(MemoryBus(hub), ("recorder", "learner"), {}, lambda read: None, lambda reason: None)
        assert await reader.pull_all(("recorder", "learner")) == ("recorder",)
        assert reader.synced == set()
        owner.live()
        assert await reader.pull("recorder")
        assert await reader.pull("learner")
        assert reader.synced == {"recorder", "learner"}

    run(test())


def test_request_during_a_pull_causes_one_more_pull() -> None:
    async def test() -> None:
        owner, reading = await read_up()
        owner.commit(1)
        first = reading.reader.pull_soon("recorder")
        await asyncio.sleep(0)
        owner.commit(1)
        assert [reading.reader.pull_soon("recorder") for _ in range(5)] == [first] * 5
        await first
        assert reading.sequence() == [1, 2]
        assert len(owner.asked) == 2

    run(test())


def test_named_session_is_read_alone_and_its_page_is_kept() -> None:
    async def test() -> None:
        owner, reading = await read_up()
        owner.commit(2)
        owner.commit(2, "s2")
        assert await reading.reader.pull("recorder", "s2")
        assert reading.sequence() == []
        assert reading.sequence("s2") == [1, 2]
        assert reading.reader.pages["recorder/s2"].heads == {"s2": 2}
        assert reading.reader.synced == set()

    run(test())


@pytest.mark.parametrize("page", [b"", b"{}", b"\xff", b"[" * 10_000, encode(marker(1))])
def test_invalid_page_is_counted_and_another_answer_is_used(page: bytes) -> None:
    async def test() -> None:
        bus = MemoryBus(Hub())
        bus.serve(OUTBOX, lambda r: r.reply(page))
        bus.serve(OUTBOX, lambda r: r.refuse(b"no"))
        owner = recorder(bus).live()
        owner.commit(2)
        reading = Reading(bus)
        assert await reading.reader.pull("recorder")
        assert reading.sequence() == [1, 2]
        assert reading.dropped == ["malformed"]

    run(test())


def test_invalid_row_stops_the_pull_and_is_counted() -> None:
    async def test() -> None:
        owner, reading = await read_up()
        owner.commit(3)
        owner.rows["s1"][1] = owner.rows["s1"][1].model_copy(update={"payload": "{}"})
        assert not await reading.reader.pull("recorder")
        assert reading.sequence() == [1]
        assert reading.dropped == ["malformed"]

    run(test())


@pytest.mark.parametrize(
    "bad", [row(1).model_copy(update={"subject": "nonsense"}), row(1, "s2").model_copy(update={"session": "s1"})]
)
def test_row_of_an_unknown_subject_or_another_session_is_malformed(bad: OutboxRow) -> None:
    with pytest.raises(MalformedMessage):
        fact_of(bad)


def test_pull_without_progress_ends() -> None:
    async def test() -> None:
        """Put back a fact whose session is not known yet, as the gateway's read model does."""
        bus = MemoryBus(Hub())
        owner = recorder(bus).live()
        owner.commit(10)

        def not_yet(read: ReadFact) -> None:
            reader.cursors["s1", "recorder"] = 0

        reader = Reader(bus, ("recorder",), {}, not_yet, lambda reason: None)
        async with asyncio.timeout(2.0):
            assert not await reader.pull("recorder")
        assert len(owner.asked) == 1

    run(test())


def test_rows_of_finished_sessions_do_not_hide_others(monkeypatch: pytest.MonkeyPatch) -> None:
    """An owner that has not closed the session yet sends all of it again; that must not fill every page."""

    async def test() -> None:
        bus = MemoryBus(Hub())
        owner = recorder(bus).live()
        owner.commit(10, "s1")
        reading = Reading(bus)
        await reading.reader.pull("recorder")
        reading.reader.forget("s1")
        owner.commit(2, "s2")
        async with asyncio.timeout(2.0):
            assert await reading.reader.pull("recorder")
        assert reading.sequence("s2") == [1, 2]
        assert reading.sequence("s1") == list(range(1, 11))

    run(test())


def test_reader_pulls_periodically(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reader_module, "PULL_EVERY_S", 0.01)

    async def test() -> None:
        owner, reading = await read_up()
        pulling = asyncio.create_task(reading.reader.run())
        owner.commit(4)
        await until(lambda: reading.sequence() == [1, 2, 3, 4])
        owner.die()
        owner.commit(1)
        await asyncio.sleep(0.05)
        owner.live()
        await until(lambda: reading.sequence() == [1, 2, 3, 4, 5])
        pulling.cancel()

    run(test())


# --- any interleaving ---

EVENT = st.one_of(
    st.tuples(st.just("commit"), st.integers(1, 4)),
    st.tuples(st.just("notification"), st.integers(1, 40)),
    st.tuples(st.just("junk"), st.sampled_from([b"", b"{}", b"\xff", b"null"])),
    st.tuples(st.just("pull"), st.just(0)),
    st.tuples(st.just("wait"), st.integers(1, 5)),
    st.tuples(st.just("die"), st.just(0)),
    st.tuples(st.just("live"), st.just(0)),
    st.tuples(st.just("reader dies"), st.integers(0, 3)),
)


class Interleaving:
    """A reader and its owner, either of which may stop at any point, and what the reader has committed."""

    def __init__(self, most: int) -> None:
        self.bus = MemoryBus(Hub())
        self.owner = recorder(self.bus, most).live()
        self.alive = True
        self.reading = Reading(self.bus)
        self.delivered: dict[str, list[int]] = {"s1": [], "s2": []}

    async def apply(self, session: str, kind: str, value: Any) -> None:
        """Let one event happen."""
        rows = self.owner.rows.setdefault(session, [])
        match kind:
            case "commit":
                self.owner.commit(value, session)
            case "notification" if value <= len(rows):
                self.owner.notify(value, session)
            case "junk":
                self.bus.put(build_key(FactKey(session, "marker")), value, attachment=str(len(rows) + 1).encode())
            case "pull":
                self.reading.reader.pull_soon("recorder")
            case "wait":
                for _ in range(value):
                    await asyncio.sleep(0)
            case "die" if self.alive:
                self.owner.die()
                self.alive = False
            case "live":
                self.revive()
            case "reader dies":
                await self.restart_reader(value)

    def revive(self) -> None:
        """Let the owner answer."""
        if not self.alive:
            self.owner.live()
            self.alive = True

    def keep(self, lost: int) -> None:
        """Commit what the reader delivered, all but the last ``lost`` facts of each session."""
        for session, sequence in self.delivered.items():
            sequence += self.reading.sequence(session)
            if lost:
                del sequence[-lost:]

    async def restart_reader(self, lost: int) -> None:
        """Replace the reader by one that continues where the old one had committed."""
        await settled()
        self.keep(lost)
        await self.bus.close()
        if self.alive:
            self.owner.live()
        self.reading = Reading(self.bus, {(s, "recorder"): len(n) for s, n in self.delivered.items()})


@settings(max_examples=300, deadline=None)
@given(
    events=st.lists(st.tuples(st.sampled_from(["s1", "s2"]), EVENT), max_size=40),
    most=st.integers(1, 5),
)
def test_any_interleaving_delivers_1_to_n_once_in_order(events: list[Any], most: int) -> None:
    """Notifications are lost, doubled, late or malformed; pulls and restarts come at any point."""

    async def test() -> None:
        mesh = Interleaving(most)
        for session, (kind, value) in events:
            await mesh.apply(session, kind, value)
        mesh.revive()
        await settled()
        assert await mesh.reading.reader.pull("recorder")
        mesh.keep(0)
        for session, rows in mesh.owner.rows.items():
            assert mesh.delivered[session] == list(range(1, len(rows) + 1))

    run(test())


async def older_journal_is_named() -> None:
    hub = Hub()
    reader = Reader(MemoryBus(hub), ("learner",), {("s1", "learner"): 7}, lambda read: None, lambda reason: None)
    heads = {"s1": 3}

    def answer(request: Request) -> None:
        request.reply(encode(OutboxPage(owner="learner", rows=[], heads=heads, complete=True)))

    MemoryBus(hub).serve("shift/v1/@service/learner/outbox", answer)
    await reader.pull("learner")
    (said,) = reader.misfits.values()
    assert "session s1: the learner's journal ends at message 3, and 7 of its messages were read before" in said
    heads["s1"] = 7
    await reader.pull("learner")
    assert reader.misfits == {}
    heads.clear()
    await reader.pull("learner")
    assert "ends at message 0" in next(iter(reader.misfits.values()))


def test_journal_older_than_its_reader_is_reported() -> None:
    asyncio.run(older_journal_is_named())
