"""Reading through the index gives what reading everything gives, and only for a file whose checksum matches."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from shift_recording.checksum import checksum_path
from shift_recording.mcap.index import facts_about, index_of
from shift_recording.mcap.reader import Recording
from shift_recording.summary import info_of
from shift_schemas.errors import UnknownThing
from shift_schemas.messages import GazeChunk
from support.verify_sessions import Session


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return Session(seed=5).interactions(60).ended().finished(tmp_path_factory.mktemp("recording"))


@pytest.mark.parametrize("topics", [("decision",), ("config", "session"), ("gaze", "observation", "marker"), ()])
def test_messages_of_topics_are_those_of_a_whole_pass(recording: Path, topics: tuple[str, ...]) -> None:
    index = index_of(recording)
    assert index is not None
    wanted = list(Recording(recording).messages(topics))
    assert list(index.messages(topics)) == wanted
    assert bool(wanted) == bool(topics)
    assert list(facts_about(recording, topics)) == list(Recording(recording).facts(topics))


def test_counts_are_those_of_a_whole_pass(recording: Path) -> None:
    counts: dict[str, int] = {}
    for message in Recording(recording).messages():
        counts[message.topic] = counts.get(message.topic, 0) + 1
    index = index_of(recording)
    assert index is not None
    assert index.counts == counts


def test_summary_from_the_index_is_that_of_a_whole_pass(recording: Path, tmp_path: Path) -> None:
    copy = tmp_path / recording.name
    copy.write_bytes(recording.read_bytes())
    assert index_of(copy) is None  # no checksum is beside it
    assert info_of(recording) == replace(info_of(copy), checksum="matches")


def test_samples_of_late_chunks_are_counted(tmp_path: Path) -> None:
    session = Session(seed=6)
    session.deliver()
    session.gaze()
    late = GazeChunk(source="tx300", seq=0, t=[0.01, 0.02], x=[0.1, 0.1], y=[0.1, 0.1])
    for seq in (session.chunks + 5, session.chunks + 4):
        t = [session.gaze_s + seq, session.gaze_s + seq + 0.01]
        session.do("monitor", late.model_copy(update={"seq": seq, "t": t}))
    path = session.ended().finished(tmp_path)
    assert {found.fact.outcome for found in Recording(path).facts(("gaze",))} == {"applied", "late"}  # type: ignore[attr-defined]
    wanted = sum(len(found.fact.t) for found in Recording(path).facts(("gaze",)))  # type: ignore[attr-defined]
    assert info_of(path).gaze_samples == wanted


def test_changed_file_has_no_index(recording: Path, tmp_path: Path) -> None:
    copy = tmp_path / recording.name
    content = bytearray(recording.read_bytes())
    checksum_path(copy).write_bytes(checksum_path(recording).read_bytes())
    copy.write_bytes(content)
    assert index_of(copy) is not None
    content[len(content) // 2] ^= 1
    copy.write_bytes(content)
    assert index_of(copy) is None
    assert info_of(copy).checksum == "differs"


def test_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(UnknownThing, match="nowhere"):
        index_of(tmp_path / "nowhere.mcap")
