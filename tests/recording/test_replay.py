"""Replay: paced, marked, and without effect on any service."""

from __future__ import annotations

import asyncio
import json
import time
from dataclasses import replace
from pathlib import Path

import pytest
from shift_recording.mcap.reader import Recording
from shift_recording.replay import Pacer, Replay, TimeLine, check_free, extent_of, play, replay_session
from shift_runtime.bus.memory import Hub, MemoryBus
from shift_runtime.bus.protocol import Incoming, Request
from shift_runtime.reader import Reader, ReadFact
from shift_schemas.codec import encode
from shift_schemas.errors import Conflict, DamagedRecording, MalformedMessage, UnknownThing
from shift_schemas.ids import is_id
from shift_schemas.messages import OutboxPage
from shift_schemas.registry import OWNERS
from shift_schemas.timestamps import NS
from support.verify_sessions import Session

RATE = 200.0


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return Session().interactions(10).ended().finished(tmp_path_factory.mktemp("whole"))


async def _heard(replay: Replay, pacer: Pacer | None = None) -> list[tuple[float, Incoming]]:
    """Return what a subscriber receives of a replay, and when, s after its start."""
    hub = Hub()
    bus, listener = MemoryBus(hub), MemoryBus(hub)
    heard: list[tuple[float, Incoming]] = []
    start = time.monotonic()
    for subject in (s for subjects in OWNERS.values() for s in subjects):
        listener.subscribe(f"shift/v1/*/{subject}", lambda i: heard.append((time.monotonic() - start, i)))
    own = pacer or Pacer(replay.rate, asyncio.get_running_loop().time)
    count = await play(bus.put, replay, extent_of(replay.path), own)
    await asyncio.sleep(0.05)
    assert count == len(heard)
    return heard


def _run(replay: Replay) -> list[tuple[float, Incoming]]:
    return asyncio.run(_heard(replay))


def test_every_fact_is_heard_in_order_under_the_replays_own_session(recording: Path) -> None:
    heard = [i for _, i in _run(Replay(recording, "again", RATE))]
    original = list(Recording(recording).messages())
    assert [i.key for i in heard] == [f"shift/v1/again/{m.topic}" for m in original]
    assert [i.attachment for i in heard] == [f"replay:{m.sequence}".encode() for m in original]
    for incoming, message in zip(heard, original, strict=True):
        fact = json.loads(incoming.payload)
        assert fact["session"] == "again"
        assert fact["stamp"] == json.loads(message.data)["stamp"]


def test_the_session_says_what_it_replays(recording: Path) -> None:
    heard = [i for _, i in _run(Replay(recording, "again", RATE, topics=("session",)))]
    assert {json.loads(i.payload)["replay_of"] for i in heard} == {"s1.mcap"}


def test_a_replay_is_paced_by_the_time_of_recording(recording: Path) -> None:
    length_s = extent_of(recording).length_s
    messages = list(Recording(recording).messages())
    heard = _run(Replay(recording, "again", 2 * length_s))  # half a second
    for (at_s, _), message in zip(heard, messages, strict=True):
        due_s = (message.log_time - messages[0].log_time) / 1e9 / (2 * length_s)
        assert due_s - 0.01 <= at_s <= due_s + 0.4


def test_topics_and_offset_leave_out_the_rest(recording: Path) -> None:
    length_s = extent_of(recording).length_s
    messages = list(Recording(recording).messages({"decision"}))
    first = next(iter(Recording(recording).messages())).log_time
    later = [m for m in messages if (m.log_time - first) / 1e9 >= length_s / 2]
    heard = [i for _, i in _run(Replay(recording, "again", RATE, length_s / 2, ("decision",)))]
    assert 0 < len(later) < len(messages)
    assert [i.attachment for i in heard] == [f"replay:{m.sequence}".encode() for m in later]


def test_duration_leaves_out_the_rest(recording: Path) -> None:
    whole = [i for _, i in _run(Replay(recording, "again", 1000.0))]
    middle = extent_of(recording).length_s / 2
    part = [i for _, i in _run(Replay(recording, "again", 1000.0, duration_s=middle))]
    assert 0 < len(part) < len(whole)
    assert [i.payload for i in part] == [i.payload for i in whole[: len(part)]]


def test_topics_get_other_names(recording: Path) -> None:
    async def keys() -> set[str]:
        heard: set[str] = set()
        replay = Replay(
            recording, "again", 1000.0, topics=("decision", "policy"), remap={"decision": "decision_before"}
        )
        pacer = Pacer(replay.rate, asyncio.get_running_loop().time)
        await play(lambda key, payload, **_: heard.add(key), replay, extent_of(recording), pacer)  # type: ignore[misc]
        return heard

    assert asyncio.run(keys()) == {"shift/v1/again/decision_before", "shift/v1/again/policy"}


def test_step_lets_one_message_pass_and_a_jump_goes_back(recording: Path) -> None:
    async def run() -> None:
        loop = asyncio.get_running_loop()
        positions: list[float] = []
        replay, extent = Replay(recording, "again", 1.0), extent_of(recording)
        pacer = Pacer(1.0, loop.time, paused=True)
        playing = asyncio.create_task(
            play(lambda *a, **k: None, replay, extent, pacer, lambda at, _: positions.append(at))
        )
        for count in (1, 2, 3):
            pacer.step()
            await asyncio.sleep(0.02)
            assert len(positions) == count
        late = extent.length_s * 0.8
        pacer.jump(late)
        pacer.step()
        await asyncio.sleep(0.05)
        assert len(positions) == 4
        assert positions[-1] >= late
        pacer.jump(0.0)
        pacer.step()
        await asyncio.sleep(0.05)
        assert positions[-1] == positions[0]
        assert pacer.paused
        pacer.change_rate(1000.0)
        pacer.pause(False)
        await asyncio.wait_for(playing, 5)
        whole = len(list(Recording(recording).messages()))
        assert len(positions) == 4 + whole

    asyncio.run(run())


def test_a_loop_begins_again_until_it_is_cancelled(recording: Path) -> None:
    async def run() -> int:
        counted = [0]

        def count(position_s: float, published: int) -> None:
            counted[0] = published

        pacer = Pacer(10_000, asyncio.get_running_loop().time)
        replay = Replay(recording, "again", 10_000, loop=True)
        playing = asyncio.create_task(play(MemoryBus(Hub()).put, replay, extent_of(recording), pacer, count))
        await asyncio.sleep(0.5)
        playing.cancel()
        with pytest.raises(asyncio.CancelledError):
            await playing
        return counted[0]

    assert asyncio.run(run()) > 2 * len(list(Recording(recording).messages()))


def test_a_paused_start_waits_and_a_pause_takes_no_time(recording: Path) -> None:
    async def run() -> None:
        pacer = Pacer(RATE, asyncio.get_running_loop().time, paused=True)
        playing = asyncio.create_task(_heard(Replay(recording, "again", RATE), pacer))
        await asyncio.sleep(0.1)
        assert not playing.done()
        assert pacer.position_s == 0
        pacer.toggle()
        heard = await asyncio.wait_for(playing, 5)
        assert heard[0][0] >= 0.1

    asyncio.run(run())


def test_a_pacers_time_stands_still_while_it_is_paused() -> None:
    now = [0.0]

    async def run() -> None:
        pacer = Pacer(2.0, lambda: now[0])
        now[0] = 1.0
        pacer.toggle()
        now[0] = 50.0
        assert (pacer.paused, pacer.position_s) == (True, 2.0)
        pacer.toggle()
        now[0] = 51.0
        assert (pacer.paused, pacer.position_s) == (False, 4.0)

    asyncio.run(run())


def test_no_reader_applies_a_replay_or_counts_it_as_malformed(recording: Path) -> None:
    async def run() -> tuple[list[ReadFact], list[str]]:
        hub = Hub()
        delivered: list[ReadFact] = []
        dropped: list[str] = []
        reader = Reader(MemoryBus(hub), tuple(OWNERS), {}, delivered.append, dropped.append)
        reader.start()
        pacer = Pacer(10_000, asyncio.get_running_loop().time)
        await play(MemoryBus(hub).put, Replay(recording, "again", 10_000), extent_of(recording), pacer)
        await asyncio.sleep(0.05)
        return delivered, dropped

    assert asyncio.run(run()) == ([], [])


@pytest.mark.parametrize(
    ("payload", "attachment"),
    [(b"{}", b"replay:1"), (b"nonsense", b"replay:1"), (b"{}", b"replay:"), (b"{}", b"replay:x"), (b"{}", b"replay")],
)
def test_what_only_claims_to_be_a_replay_is_counted(payload: bytes, attachment: bytes) -> None:
    async def run() -> list[str]:
        hub = Hub()
        dropped: list[str] = []
        Reader(MemoryBus(hub), tuple(OWNERS), {}, lambda read: None, dropped.append).start()
        MemoryBus(hub).put("shift/v1/again/decision", payload, attachment=attachment)
        await asyncio.sleep(0.05)
        return dropped

    assert asyncio.run(run()) == ["malformed"]


def test_a_session_that_is_there_is_not_replayed_into() -> None:
    async def run(session: str) -> None:
        hub = Hub()
        page = OutboxPage(owner="recorder", rows=[], heads={"s1": 3, "again": 0}, complete=True)

        def answer(request: Request) -> None:
            request.reply(encode(page))

        MemoryBus(hub).serve("shift/v1/@service/recorder/outbox", answer)
        await check_free(MemoryBus(hub), session)

    asyncio.run(run("again"))
    with pytest.raises(Conflict, match="s1"):
        asyncio.run(run("s1"))


@pytest.mark.parametrize("recorded", ["s1", "x" * 63, ""])
def test_a_replays_own_session_is_an_id(recorded: str) -> None:
    assert is_id(replay_session(recorded))
    assert replay_session(recorded) != replay_session(recorded)


@pytest.mark.parametrize(
    "wrong",
    [{"session": "a/b"}, {"rate": 0.0}, {"rate": float("nan")}, {"start_offset_s": -1.0}, {"topics": ("secrets",)}],
    ids=str,
)
def test_what_cannot_be_is_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(MalformedMessage):
        replace(Replay(Path("s1.mcap"), "again"), **wrong)  # type: ignore[arg-type]


def test_no_file_and_an_empty_recording_are_said(tmp_path: Path) -> None:
    with pytest.raises(UnknownThing):
        extent_of(tmp_path / "s1.mcap")
    session = Session()
    session.recorded.clear()
    with pytest.raises(DamagedRecording, match="no messages"):
        extent_of(session.segment(tmp_path))


def test_pauses_longer_than_the_longest_are_shortened_and_steps_back_left_out() -> None:
    line = TimeLine(10.0)
    times = [0, NS, 2 * NS, 2 * NS + 365 * 86400 * NS, NS, 2 * NS]
    assert [line.position_s(1_700_000_000 * NS + t) for t in times] == [0.0, 1.0, 2.0, 12.0, 12.0, 13.0]
    assert (line.shortened, line.left_out_ns) == (1, 365 * 86400 * NS - 10 * NS)
    unlimited = TimeLine(0.0)
    assert [unlimited.position_s(t * NS) for t in (0, 50)] == [0.0, 50.0]


def test_pacer_goes_on_from_its_position_at_another_rate() -> None:
    now = [0.0]

    async def positions() -> tuple[float, float, float]:
        pacer = Pacer(2.0, lambda: now[0])
        now[0] = 3.0
        pacer.change_rate(10.0)
        at_change = pacer.position_s
        now[0] = 4.0
        later = pacer.position_s
        pacer.toggle()
        pacer.change_rate(1.0)
        now[0] = 9.0
        return at_change, later, pacer.position_s

    assert asyncio.run(positions()) == (6.0, 16.0, 16.0)
