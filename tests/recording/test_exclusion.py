"""The exclusion beside a recording: every change is kept, and the last one holds."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from shift_recording.exclusion import ExclusionEntry, add_entry, exclusion_path, read_exclusion
from shift_schemas.errors import DamagedRecording, UnknownThing
from shift_schemas.timestamps import Stamp


def entry(excluded: bool, reason: str, at: int = 1) -> ExclusionEntry:
    """Return a change by Ada."""
    return ExclusionEntry(excluded=excluded, reason=reason, author="Ada", time=Stamp(sec=at, nsec=0))


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    """Return a file in the place of a recording."""
    path = tmp_path / "s1.mcap"
    path.write_bytes(b"whole")
    return path


def test_recording_without_the_file_is_not_excluded(recording: Path) -> None:
    assert read_exclusion(recording).in_force is None


def test_exclusion_is_kept_with_reason_author_time_and_format(recording: Path) -> None:
    add_entry(recording, entry(True, "calibration failed"))
    found = read_exclusion(recording).in_force
    assert found is not None
    assert (found.reason, found.author, found.time.sec) == ("calibration failed", "Ada", 1)
    written = json.loads(exclusion_path(recording).read_text())
    assert (written["format"], written["recording"]) == (1, "s1.mcap")
    assert exclusion_path(recording).name == "s1.mcap.exclusion.json"
    assert recording.read_bytes() == b"whole"
    assert {p.name for p in recording.parent.iterdir()} == {"s1.mcap", "s1.mcap.exclusion.json"}


def test_exclusion_that_was_taken_back_is_still_told(recording: Path) -> None:
    add_entry(recording, entry(True, "calibration failed"))
    after = add_entry(recording, entry(False, "the calibration was good", 2))
    assert after.in_force is None
    assert [e.reason for e in read_exclusion(recording).entries] == ["calibration failed", "the calibration was good"]


@pytest.mark.parametrize("text", ["", "{", '{"format": 2, "recording": "s1.mcap", "entries": []}', "[1]"])
def test_file_that_cannot_be_read_is_named_and_not_overwritten(recording: Path, text: str) -> None:
    exclusion_path(recording).write_text(text)
    with pytest.raises(DamagedRecording, match=r"s1\.mcap\.exclusion\.json"):
        add_entry(recording, entry(True, "calibration failed"))
    assert exclusion_path(recording).read_text() == text


def test_nothing_is_written_beside_a_recording_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(UnknownThing):
        add_entry(tmp_path / "s2.mcap", entry(True, "calibration failed"))
    assert list(tmp_path.iterdir()) == []
