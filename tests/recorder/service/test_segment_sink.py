"""The recorder's sink: a fact counts as read once it is on the disk, and a refused write is written again."""

from __future__ import annotations

from pathlib import Path

import pytest
from shift_recorder import core
from shift_recorder.core import RecorderState
from shift_recorder.service import CORE
from shift_recorder.service.segment_sink import SegmentSink
from shift_recording.durable_file import StorageFailed
from shift_recording.mcap.reader import Recording
from shift_recording.segments import SegmentWriter, segments_of
from shift_runtime.bus.memory import Hub, MemoryBus
from shift_runtime.clock import ManualClock
from shift_runtime.journal import Batch
from shift_runtime.metrics import Metrics
from shift_runtime.reader import Reader, ReadFact
from shift_runtime.service.disk_alarm import DiskAlarm
from shift_runtime.service.progress import Progress
from shift_runtime.service.states import SessionStates
from shift_schemas.messages import Fact, Session, StartSession
from shift_schemas.timestamps import Stamp
from support.runtime_fixtures import marker
from support.service_parts import Schedule
from support.worker_rig import FullDisk

pytestmark = pytest.mark.anyio
START = StartSession(command_id="start", session="s1", participant="P1", study={"study": "mine"})
KEY = ("s1", "recorder")


class Desk:
    """A sink with a live session s1 in the journal."""

    def __init__(self, data: Path) -> None:
        self.data = data
        self.journal = FullDisk(data / "state" / "recorder.sqlite", "recorder")
        self.state: RecorderState = core.step(None, START, Stamp.of(1)).state
        self.journal.commit(Batch(states={"s1": core.dump(self.state)}))
        self.states, self.metrics = SessionStates(CORE, self.journal), Metrics("recorder")
        self.reader = Reader(MemoryBus(Hub()), ("recorder",), {}, lambda fact: None, self.metrics.dropped)
        self.progress = Progress(self.reader, self.journal)
        self.alarm = DiskAlarm(self.journal.check, Schedule())
        self.closed: list[str] = []
        self.sink = SegmentSink(
            data / "segments", self.states, self.reader, self.progress, self.journal, self.alarm, ManualClock(9),
            self.metrics, self.closed.append,
        )  # fmt: skip

    def apply(self, *numbers: int) -> None:
        for n in numbers:
            self.apply_fact(n, marker(n))

    def apply_fact(self, n: int, fact: Fact) -> None:
        self.reader.cursors[KEY] = n
        self.sink.apply(ReadFact("recorder", n, fact, fact.model_dump_json()))

    @property
    def segments(self) -> list[Path]:
        return segments_of(self.data / "segments", "s1")

    def written(self) -> list[int]:
        return [m.sequence for segment in self.segments for m in Recording(segment).messages()]


@pytest.fixture
def desk(tmp_path: Path) -> Desk:
    return Desk(tmp_path)


async def test_fact_counts_as_read_only_after_the_flush(desk: Desk) -> None:
    desk.apply(1, 2)
    assert desk.progress.processed[KEY] == 2
    assert desk.journal.cursors() == {}
    desk.sink.flush()
    assert desk.journal.cursors() == {KEY: 2}
    assert desk.written() == [1, 2]


async def test_flush_without_anything_new_commits_nothing(desk: Desk) -> None:
    desk.apply(1)
    desk.sink.flush()
    commits = desk.journal.commits
    desk.sink.flush()
    assert desk.journal.commits == commits


async def test_fact_that_is_not_next_is_not_written(desk: Desk) -> None:
    desk.apply(1, 1, 3)
    desk.sink.flush()
    assert desk.written() == [1]


async def test_fact_of_an_unknown_session_is_counted_and_forgotten(desk: Desk) -> None:
    stranger = marker(1, "s2")
    desk.reader.cursors["s2", "recorder"] = 1
    desk.sink.apply(ReadFact("recorder", 1, stranger, stranger.model_dump_json()))
    assert ("s2", "recorder") not in desk.reader.cursors
    assert b'shift_messages_dropped_total{reason="refused",service="recorder"} 1.0' in desk.metrics.text()
    assert desk.sink.sessions == []


async def test_refused_write_goes_back_to_what_is_committed(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    desk.apply(1)
    desk.sink.flush()
    desk.apply(2)

    def refuse(self: SegmentWriter, *given: object) -> None:
        raise StorageFailed("no space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(SegmentWriter, "write", refuse)
        desk.apply(3)
    assert desk.alarm.detail == "no space left on device"
    assert desk.reader.cursors[KEY] == desk.progress.processed[KEY] == 1
    assert desk.sink.sessions == []
    desk.apply(2, 3)
    desk.sink.flush()
    assert desk.alarm.detail == ""
    assert desk.journal.cursors() == {KEY: 3}
    assert [m.sequence for m in Recording(desk.segments[-1]).messages()] == [2, 3]


async def test_refused_commit_of_a_flush_is_written_again(desk: Desk) -> None:
    desk.apply(1)
    desk.journal.full = True
    desk.sink.flush()
    assert "disk is full" in desk.alarm.detail
    assert desk.progress.processed[KEY] == 0
    desk.journal.full = False
    desk.apply(1)
    desk.sink.flush()
    assert desk.journal.cursors() == {KEY: 1}
    assert len(desk.segments) == 2


async def test_end_of_the_session_closes_it_and_removes_its_segments(desk: Desk) -> None:
    desk.apply(1)
    desk.sink.flush()
    desk.sink.finish_segment("s1")
    ended: Session = core.ended(desk.state)
    desk.states.put("s1", RecorderState(ended, desk.state.config, desk.state.original))
    desk.journal.heads["s1"] = 3
    desk.apply(2)
    assert desk.closed == []
    assert desk.segments
    desk.apply_fact(3, ended)
    assert desk.closed == ["s1"]
    assert desk.segments == []
    assert desk.progress.processed[KEY] == 3
