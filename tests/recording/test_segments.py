"""Segments: what was flushed is there, whatever happens to the one who wrote it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from mcap.reader import make_reader
from shift_recording.durable_file import DurableFile, StorageFailed
from shift_recording.mcap.reader import Recording
from shift_recording.mcap.records import Attachment
from shift_recording.mcap.writer import MAXIMUM_PAYLOAD, RecordingWriter
from shift_recording.segments import SegmentWriter, segments_of
from shift_schemas.errors import MalformedMessage, TooLarge
from shift_schemas.registry import SUBJECTS
from support.recordings import SCHEMAS, interleaved, write_segment

HERE = Path(__file__).parents[1]


def test_a_finished_segment_is_a_valid_file_with_index(tmp_path: Path) -> None:
    path = write_segment(tmp_path, interleaved(40), finish=True)
    with open(path, "rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_count == 120
        assert sum(1 for _ in reader.iter_messages()) == 120
        assert {c.topic for c in summary.channels.values()} == set(SUBJECTS)
        assert all(c.schema_id and c.message_encoding == "json" for c in summary.channels.values())
        assert all(s.encoding == "jsonschema" for s in summary.schemas.values())
        header = reader.get_header()
        assert header.profile == ""
        assert header.library.startswith("shift-mesh/")


def test_what_was_flushed_can_be_read_while_the_segment_is_open(tmp_path: Path) -> None:
    segment = SegmentWriter(tmp_path, "s1", SCHEMAS)
    messages = interleaved(2)
    for message in messages[:4]:
        segment.write(*message)
    assert segment.flush() == 4
    segment.write(*messages[4])
    assert [tuple(m) for m in Recording(segment.path).messages()] == [tuple(m) for m in messages[:4]]
    segment.abandon()


def test_segments_are_numbered_and_none_is_overwritten(tmp_path: Path) -> None:
    paths = [write_segment(tmp_path, interleaved(1)) for _ in range(3)]
    assert [p.name for p in paths] == ["0001.mcap", "0002.mcap", "0003.mcap"]
    paths[0].unlink()
    assert write_segment(tmp_path, interleaved(1)).name == "0004.mcap"
    assert [p.name for p in segments_of(tmp_path, "s1")] == ["0002.mcap", "0003.mcap", "0004.mcap"]


@pytest.mark.parametrize("session", ["../x", "a/b", "**", "", "a\n", "x" * 64])
def test_a_session_that_is_no_id_never_reaches_the_file_system(tmp_path: Path, session: str) -> None:
    with pytest.raises(MalformedMessage):
        SegmentWriter(tmp_path, session, SCHEMAS)
    assert not list(tmp_path.iterdir())


def test_a_refused_message_leaves_the_segment_as_it_was(tmp_path: Path) -> None:
    segment = SegmentWriter(tmp_path, "s1", SCHEMAS)
    segment.write("marker", 1, 1, 1, b"{}")
    with pytest.raises(MalformedMessage, match="none of"):
        segment.write("markers", 2, 1, 1, b"{}")
    with pytest.raises(MalformedMessage):
        segment.write("marker", 2, -1, 1, b"{}")
    with pytest.raises(MalformedMessage):
        segment.write("marker", 2, 1, 2**64, b"{}")
    with pytest.raises(TooLarge):
        segment.write("marker", 2, 1, 1, bytes(MAXIMUM_PAYLOAD + 1))
    segment.write("marker", 2, 1, 1, b"{}")
    segment.finish()
    recording = Recording(segment.path)
    assert [m.sequence for m in recording.messages()] == [1, 2]
    assert recording.report.complete


def test_what_a_reader_would_refuse_is_not_written(tmp_path: Path) -> None:
    writer = RecordingWriter(DurableFile(tmp_path / "s1.mcap", new=True), SCHEMAS, 1000)
    with pytest.raises(TooLarge, match="metadata shift:config"):
        writer.metadata("shift:config", {"study": "x" * 2**20})
    with pytest.raises(TooLarge, match="attachment big"):
        writer.attachment(Attachment("big", "", bytes(32 * 2**20), 0))


def test_the_largest_message_that_is_taken_can_be_read(tmp_path: Path) -> None:
    segment = SegmentWriter(tmp_path, "s1", SCHEMAS)
    segment.write("marker", 1, 1, 1, os.urandom(MAXIMUM_PAYLOAD))
    segment.finish()
    assert [len(m.data) for m in Recording(segment.path).messages()] == [MAXIMUM_PAYLOAD]


def run(code: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run Python code in its own process, with the tests' modules."""
    path = os.pathsep.join([str(HERE), *sys.path])
    return subprocess.run(
        [sys.executable, "-c", code, *arguments],
        capture_output=True, text=True, env={**os.environ, "PYTHONPATH": path}, timeout=120, check=False,
    )  # fmt: skip


KILLED = """
import os, signal, sys
from pathlib import Path
from support.recordings import SCHEMAS, interleaved
from shift_recording.segments import SegmentWriter
segment = SegmentWriter(Path(sys.argv[1]), "s1", SCHEMAS)
for i, message in enumerate(interleaved(700), start=1):
    segment.write(*message)
    if i % 100 == 0:
        segment.flush()
        print(i, flush=True)
    if i == int(sys.argv[2]):
        os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.parametrize("at", [1, 99, 100, 1234, 1893])
def test_kill_9_loses_nothing_that_was_flushed(tmp_path: Path, at: int) -> None:
    done = run(KILLED, str(tmp_path), str(at))
    assert done.returncode == -signal.SIGKILL
    flushed = max([0, *map(int, done.stdout.split())])
    assert flushed == at // 100 * 100
    recording = Recording(tmp_path / "s1" / "0001.mcap")
    assert [tuple(m) for m in recording.messages()] == [tuple(m) for m in interleaved(700)[:flushed]]
    assert not recording.report.complete
    assert not recording.report.damaged


READ_ONLY = """
import os, sys
from pathlib import Path
from support.recordings import SCHEMAS
from shift_recording.segments import SegmentWriter
from shift_recording.durable_file import StorageFailed
if os.geteuid() == 0:
    os.seteuid(65534)
try:
    SegmentWriter(Path(sys.argv[1]), "s1", SCHEMAS)
except StorageFailed as e:
    print("refused" if "s1" in e.detail else e.detail)
else:
    print("written")
"""

FULL = """
import resource, signal, sys
from pathlib import Path
from support.recordings import SCHEMAS, interleaved
from shift_recording.segments import SegmentWriter
from shift_recording.durable_file import StorageFailed
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
segment = SegmentWriter(Path(sys.argv[1]), "s1", SCHEMAS)
resource.setrlimit(resource.RLIMIT_FSIZE, (40_000, 40_000))
flushed = 0
try:
    for message in interleaved(5000):
        segment.write(*message)
        flushed += segment.flush()
except StorageFailed as e:
    print(flushed, e.kind, e.status)
    try:
        segment.flush()
    except StorageFailed:
        print("still refused")
"""


def test_a_full_disk_is_said_and_what_was_flushed_can_be_read(tmp_path: Path) -> None:
    done = run(FULL, str(tmp_path))
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    said = done.stdout.split()
    assert said[1:] == ["unavailable", "503", "still", "refused"]
    recording = Recording(tmp_path / "s1" / "0001.mcap")
    assert sum(1 for _ in recording.messages()) == int(said[0]) > 10
    assert recording.report.bytes == recording.path.stat().st_size  # the failed chunk was cut off again


def test_a_read_only_folder_is_said(tmp_path: Path) -> None:
    """Root may write anywhere, so a process without root's rights tries it."""
    tmp_path.chmod(0o555)
    for parent in tmp_path.parents[:3]:
        parent.chmod(parent.stat().st_mode | 0o011)
    done = run(READ_ONLY, str(tmp_path))
    assert done.stdout.split() == ["refused"], done.stderr


def test_a_file_in_the_folders_place_is_said(tmp_path: Path) -> None:
    (tmp_path / "s1").write_text("")
    with pytest.raises(StorageFailed, match=r"s1"):
        SegmentWriter(tmp_path, "s1", SCHEMAS)
