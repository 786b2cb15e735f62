"""Recovery: everything that can be read is in the new file, in its order, and every loss is reported."""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from shift_recording.checksum import check
from shift_recording.mcap.reader import Recording
from shift_recording.recovery import Recovered, Wanted, recover
from shift_schemas.errors import Conflict, UnknownThing
from shift_verify.verify import verify
from support.verify_sessions import Session

Message = tuple[str, int, int, int, bytes]


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return Session(seed=3).interactions(20).ended().finished(tmp_path_factory.mktemp("recording"))


def foreign(path: Path, compression: CompressionType = CompressionType.LZ4, start_s: int = 0) -> Path:
    """Write a file as another program does: ROS 2 channels with metadata, in many small chunks."""
    with open(path, "wb") as stream:
        writer = Writer(stream, chunk_size=400, compression=compression)
        writer.start(profile="ros2", library="rosbag2")
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data")
        channels = [writer.register_channel(f"/t{i}", "cdr", schema, {"qos": f"q{i}"}) for i in range(3)]
        for n in range(300):
            at = (start_s + n) * 10**9
            writer.add_message(
                channels[n % 3], log_time=at, publish_time=at + 1, sequence=n, data=bytes([n % 256]) * 20
            )
        writer.add_metadata("about", {"robot": "nao"})
        writer.add_attachment(1, 1, "map.png", "image/png", b"\x89PNG")
        writer.finish()
    return path


def messages(path: Path) -> list[Message]:
    """Return the messages of a file by the reader of the package mcap, in the file's order."""
    with open(path, "rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        found = reader.iter_messages(log_time_order=False)
        return [(c.topic, m.sequence, m.log_time, m.publish_time, m.data) for _, c, m in found]


def recovered(source: Path, target: Path, wanted: Wanted = Wanted()) -> Recovered:  # noqa: B008 (it is frozen)
    (found,) = recover([source], target, wanted)
    return found


def test_whole_recording_is_the_same_and_verifies(recording: Path, tmp_path: Path) -> None:
    found = recovered(recording, tmp_path / "new.mcap")
    assert (found.complete, found.lost_bytes, found.problems) == (True, 0, [])
    assert messages(tmp_path / "new.mcap") == messages(recording)
    assert found.messages == len(messages(recording))
    report = verify(tmp_path / "new.mcap")
    assert (report.ok, report.complete, report.checksum) == (True, True, "matches")


def test_unfinished_segment_becomes_a_whole_file(tmp_path: Path) -> None:
    segment = Session(seed=3).interactions(8).segment(tmp_path)
    found = recovered(segment, tmp_path / "new.mcap")
    assert not found.complete
    recording = Recording(tmp_path / "new.mcap")
    assert len(list(recording.facts())) == found.messages > 0
    assert recording.report.complete


@pytest.mark.parametrize("compression", list(CompressionType), ids=lambda c: c.name)
def test_file_of_another_program_keeps_everything(tmp_path: Path, compression: CompressionType) -> None:
    source = foreign(tmp_path / "bag.mcap", compression)
    found = recovered(source, tmp_path / "new.mcap")
    assert (found.complete, found.messages) == (True, 300)
    assert messages(tmp_path / "new.mcap") == messages(source)
    with open(tmp_path / "new.mcap", "rb") as stream:
        reader = make_reader(stream)
        summary: Any = reader.get_summary()
        assert reader.get_header().profile == "ros2"
        assert {c.topic: c.metadata for c in summary.channels.values()}["/t1"] == {"qos": "q1"}
        assert [(s.name, s.encoding, s.data) for s in summary.schemas.values()] == [
            ("std_msgs/msg/String", "ros2msg", b"string data")
        ]
        assert [(m.name, m.metadata) for m in reader.iter_metadata()] == [("about", {"robot": "nao"})]
        assert [(a.name, a.data) for a in reader.iter_attachments()] == [("map.png", b"\x89PNG")]


def test_damaged_chunk_is_skipped_and_the_others_are_kept(tmp_path: Path) -> None:
    source = foreign(tmp_path / "bag.mcap", CompressionType.NONE)
    data = bytearray(source.read_bytes())
    data[data.index(bytes([100]) * 20) + 5] ^= 0x40
    source.write_bytes(bytes(data))
    found = recovered(source, tmp_path / "new.mcap")
    kept = messages(tmp_path / "new.mcap")
    assert not found.complete
    assert 280 <= found.messages == len(kept) < 300
    assert 0 < found.lost_bytes < 1000
    assert "checksum" in found.problems[0]
    assert check(tmp_path / "new.mcap").value == "matches"


def test_truncation_anywhere_gives_a_prefix(recording: Path, tmp_path: Path) -> None:
    whole, data = messages(recording), recording.read_bytes()
    for i in range(40):
        cut = random.Random(i).randrange(1, len(data))
        source, target = tmp_path / f"cut{i}.mcap", tmp_path / f"new{i}.mcap"
        source.write_bytes(data[:cut])
        found = recovered(source, target)
        assert not found.complete
        kept = messages(target)
        assert kept == whole[: len(kept)]


def test_flipped_bits_never_give_wrong_messages(recording: Path, tmp_path: Path) -> None:
    whole, data = set(messages(recording)), recording.read_bytes()
    for i in range(60):
        rng = random.Random(i)
        changed = bytearray(data)
        changed[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
        source, target = tmp_path / f"flip{i}.mcap", tmp_path / f"new{i}.mcap"
        source.write_bytes(bytes(changed))
        recovered(source, target)
        assert set(messages(target)) <= whole


def test_what_is_not_mcap_gives_an_empty_file(tmp_path: Path) -> None:
    source = tmp_path / "no.mcap"
    source.write_bytes(b"not a recording at all")
    found = recovered(source, tmp_path / "new.mcap")
    assert (found.complete, found.messages, found.lost_bytes) == (False, 0, 22)
    assert messages(tmp_path / "new.mcap") == []


# --- parts and several files ---


def test_topics_and_times_are_filtered(tmp_path: Path) -> None:
    source = foreign(tmp_path / "bag.mcap")
    recovered(source, tmp_path / "new.mcap", Wanted(("/t1",), start_s=10, end_s=20))
    assert [(m[0], m[2] // 10**9) for m in messages(tmp_path / "new.mcap")] == [
        ("/t1", n) for n in range(10, 21) if n % 3 == 1
    ]


def test_several_files_are_merged_by_log_time(tmp_path: Path) -> None:
    first, second = foreign(tmp_path / "a.mcap"), foreign(tmp_path / "b.mcap", start_s=100)
    found = recover([first, second], tmp_path / "both.mcap")
    both = messages(tmp_path / "both.mcap")
    assert [each.messages for each in found] == [300, 300]
    assert [m[2] for m in both] == sorted(m[2] for m in both)
    assert sorted(both) == sorted([*messages(first), *messages(second)])


@pytest.mark.parametrize("size", [10_000, 32 * 2**20])
def test_messages_are_sorted_in_bounded_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, size: int) -> None:
    monkeypatch.setattr("shift_recording.recovery.SORTED_BYTES", size)
    rng = random.Random(5)
    source = tmp_path / "shuffled.mcap"
    times = [rng.randrange(10**9) for _ in range(500)]
    with open(source, "wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = writer.register_schema("s", "", b"")
        channel = writer.register_channel("/t", "json", schema)
        for i, time in enumerate(times):
            writer.add_message(channel, time, f"{i}".encode(), time)
        writer.finish()
    recover([source], tmp_path / "sorted.mcap", Wanted(sorted=True))
    found = [(m[2], m[4]) for m in messages(tmp_path / "sorted.mcap")]
    assert found == sorted((time, f"{i}".encode()) for i, time in enumerate(times))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["shuffled.mcap", "sorted.mcap", "sorted.mcap.sha256"]


def test_nothing_is_overwritten(recording: Path, tmp_path: Path) -> None:
    with pytest.raises(Conflict, match="exists already"):
        recover([recording], recording)
    with pytest.raises(UnknownThing, match="there is no file"):
        recover([tmp_path / "none.mcap"], tmp_path / "new.mcap")
    assert not (tmp_path / "new.mcap").exists()
