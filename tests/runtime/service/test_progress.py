"""Progress: facts are processed in their order, and a rewind lets the reader deliver them again."""

from __future__ import annotations

from pathlib import Path

import pytest
from shift_runtime.journal import Batch, Journal
from shift_runtime.service.progress import Progress
from support.service_parts import Positions, read

KEY = ("s1", "monitor")


@pytest.fixture
def reader() -> Positions:
    return Positions({KEY: 3})


@pytest.fixture
def progress(reader: Positions, tmp_path: Path) -> Progress:
    journal = Journal(tmp_path / "decider.sqlite", "decider")
    journal.commit(Batch(states={"s1": ""}, cursors={KEY: 2}))
    return Progress(reader, journal)


def test_only_the_fact_after_the_last_processed_one_is_next(progress: Progress) -> None:
    assert [n for n in range(7) if progress.is_next(read(n))] == [4]
    progress.mark(read(4))
    assert [n for n in range(7) if progress.is_next(read(n))] == [5]
    assert progress.is_next(read(1, owner="recorder"))


def test_fact_that_is_put_back_is_delivered_again(progress: Progress, reader: Positions) -> None:
    reader.cursors[KEY] = 4
    progress.put_back(read(4))
    assert reader.cursors[KEY] == 3
    assert progress.processed[KEY] == 3


def test_rewind_goes_back_to_what_is_committed(progress: Progress, reader: Positions) -> None:
    progress.mark(read(4))
    progress.mark(read(1, owner="recorder"))
    progress.rewind([KEY, ("s1", "recorder")])
    assert reader.cursors == progress.processed == {KEY: 2, ("s1", "recorder"): 0}


def test_restart_reads_everything_again(progress: Progress, reader: Positions) -> None:
    progress.restart(*KEY)
    assert reader.cursors == progress.processed == {KEY: 0}
    assert progress.is_next(read(1))
