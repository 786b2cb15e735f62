"""The sink that steps a core: each fact once and in its order; a fact that comes too early is deferred."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import pytest
from shift_runtime.clock import ManualClock
from shift_runtime.metrics import Metrics
from shift_runtime.reader import ReadFact
from shift_runtime.service.background import BackgroundTasks
from shift_runtime.service.core_sink import CoreSink
from shift_runtime.service.disk_alarm import DiskAlarm
from shift_runtime.service.progress import Progress
from shift_runtime.service.states import SessionStates
from shift_runtime.service.transaction import Transactions
from shift_runtime.service.waiting import Waiting
from shift_schemas.messages import Marker
from shift_schemas.timestamps import Stamp
from support.service_parts import Schedule, read
from support.worker_rig import CORE, FullDisk, Notes, config, fixation, session

MARKER = Marker(session="s1", stamp=Stamp.of(1), marker_id="m", text="")


@dataclass
class Reader:
    """Cursors; it pulls nothing."""

    cursors: dict[tuple[str, str], int] = field(default_factory=dict)
    owners: tuple[str, ...] = ("recorder", "monitor")


class Again(Waiting):
    """Notes whose facts are read again later."""

    def __init__(self) -> None:
        super().__init__("decider", Reader(), BackgroundTasks(), lambda request: None)  # type: ignore[arg-type]
        self.owners: list[str] = []

    def read_again(self, owner: str) -> None:
        self.owners.append(owner)


class Desk:
    """The sink of one service."""

    def __init__(self, path: Path) -> None:
        journal, schedule, metrics = FullDisk(path, "decider"), Schedule(), Metrics("decider")
        self.reader, self.again = Reader(), Again()
        self.states = SessionStates(CORE, journal)
        self.progress = Progress(self.reader, journal)
        alarm = DiskAlarm(journal.check, schedule)
        self.transactions = Transactions(journal, self.states, self.progress, alarm, metrics, schedule)
        self.sink = CoreSink(CORE, self.states, self.progress, self.transactions, self.again, ManualClock(5), metrics)

    def apply(self, *facts: ReadFact) -> None:
        for fact in facts:
            self.reader.cursors[fact.fact.session, fact.owner] = fact.seq
            self.sink.apply(fact)


@pytest.fixture
def desk(tmp_path: Path) -> Desk:
    return Desk(tmp_path / "decider.sqlite")


def started() -> tuple[ReadFact, ReadFact]:
    return read(1, session(), "recorder"), read(2, config(), "recorder")


def test_core_steps_on_each_fact_and_its_cursor_goes_into_the_transaction(desk: Desk) -> None:
    desk.apply(*started(), read(1), read(2))
    assert desk.states.get("s1") == Notes("s1", 1, ("fixation 1", "fixation 2"))
    assert desk.transactions.open.batch.cursors == {("s1", "recorder"): 2, ("s1", "monitor"): 2}
    assert [row.seq for row in desk.transactions.open.batch.rows] == [1, 2]


def test_fact_that_is_not_next_is_ignored(desk: Desk) -> None:
    desk.apply(*started(), read(1))
    desk.sink.apply(read(1))
    desk.sink.apply(read(3))
    assert desk.progress.processed["s1", "monitor"] == 1
    assert desk.again.owners == []


@pytest.mark.parametrize("before", [0, 1], ids=["before its session", "before its configuration"])
def test_fact_that_comes_too_early_is_delivered_again(desk: Desk, before: int) -> None:
    desk.apply(*started()[:before], read(1))
    assert desk.again.owners == ["monitor"]
    assert desk.reader.cursors["s1", "monitor"] == 0
    assert ("s1", "monitor") not in desk.transactions.open.batch.cursors
    desk.apply(*started()[before:], read(1))
    assert desk.states.get("s1") == Notes("s1", 1, ("fixation 1",))


def test_subject_that_the_core_does_not_read_is_passed_over_once_its_session_is_known(desk: Desk) -> None:
    other = read(1, fixation(1).model_copy(update={"session": "s2"}))
    desk.apply(other)
    assert desk.again.owners == ["monitor"]
    desk.apply(*started(), read(3, MARKER, "recorder"))
    assert desk.progress.processed["s1", "recorder"] == 3
    assert desk.states.get("s1") == Notes("s1", 1)


def test_early_fact_of_a_subject_that_the_core_does_not_read_takes_no_place(desk: Desk) -> None:
    desk.apply(read(1, MARKER, "recorder"))
    assert desk.again.owners == ["recorder"]
    desk.apply(*started())
    assert desk.states.get("s1") == Notes("s1", 1)


def test_end_of_a_session_closes_it(desk: Desk) -> None:
    desk.apply(*started(), read(3, session(state="ending"), "recorder"))
    assert desk.transactions.open.batch.closed == set()
    desk.apply(read(4, session(state="ended"), "recorder"))
    assert desk.transactions.open.batch.closed == {"s1"}
