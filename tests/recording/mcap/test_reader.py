"""Reading: a clean prefix of what is cut off, right or refused where bits flipped, bounded memory."""

from __future__ import annotations

import json
import os
import random
import subprocess
import sys
from pathlib import Path

import lz4.frame  # type: ignore[import-untyped]
import pytest
import zstandard
from shift_recording.checksum import check
from shift_recording.mcap.reader import RecordedMessage, Recording, fact_of, facts
from shift_recording.mcap.records import CHUNK
from shift_schemas.errors import DamagedRecording, MalformedMessage, UnknownThing
from support.recordings import (
    HEADER,
    MAGIC,
    chunk,
    decision_fact,
    finished,
    honest_chunk,
    interleaved,
    marker_fact,
    record,
    write_segment,
)


def read(path: Path) -> tuple[list[RecordedMessage], Recording, DamagedRecording | None]:
    """Return what can be read of a file, and the error if it is refused. Any other error fails the test."""
    recording, found = Recording(path), []
    try:
        for message in recording.messages():
            found.append(message)
    except DamagedRecording as e:
        return found, recording, e
    return found, recording, None


def test_a_finished_recording_is_read_whole(whole: Path) -> None:
    found, recording, error = read(whole)
    assert error is None
    assert [tuple(m) for m in found] == [tuple(m) for m in interleaved(40)]
    assert recording.report.complete
    assert recording.report.reason == ""
    assert recording.report.bytes == whole.stat().st_size
    assert recording.metadata["shift:session"] == {"participant": "P01", "seed": "7", "session": "s1"}
    assert recording.attachments["study.json"].data == b'{"study": "coffee"}'
    assert json.loads(recording.schemas["gaze"])["title"] == "shift.Gaze.v1"
    assert recording.library.startswith("shift-mesh/")


def test_topics_can_be_chosen(whole: Path) -> None:
    assert [m.sequence for m in Recording(whole).messages({"decision"})] == list(range(1, 41))


def test_facts_come_back_as_they_were_put_out(whole: Path) -> None:
    found = {(f.fact.subject, f.sequence): f.fact for f in facts(whole)}
    for n in range(1, 41):
        assert found["decision", n] == decision_fact(n, 0.5 if n % 2 else None)
        assert found["marker", n] == marker_fact(n)


def test_a_payload_that_is_no_fact_is_a_damaged_recording(tmp_path: Path) -> None:
    message = interleaved(1)[2]._replace(data=b'{"session": 3}')
    path = write_segment(tmp_path, [message])
    with pytest.raises(DamagedRecording, match=r"0001.mcap: marker 1"):
        list(facts(path))


@pytest.mark.parametrize("data", [b"", b"[]", b"null", b"{", b"\xff", b"[" * 10_000, b'{"n": NaN}'])
def test_a_payload_of_any_bytes_is_refused_by_name(data: bytes) -> None:
    for topic in ("decision", "marker", "nonsense"):
        with pytest.raises(MalformedMessage):
            fact_of(topic, data)


def test_a_missing_file_is_unknown_and_not_damaged(tmp_path: Path) -> None:
    with pytest.raises(UnknownThing):
        list(facts(tmp_path / "s9.mcap"))


@pytest.mark.parametrize("name", ["whole", "segment"])
def test_cut_off_at_any_byte_gives_a_clean_prefix_and_says_so(
    name: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    path: Path = request.getfixturevalue(name)
    data, expected = path.read_bytes(), [tuple(m) for m in interleaved(40)]
    points = [*random.Random(13).sample(range(len(data)), 500), *range(12), len(data) - 1]
    lengths = set()
    for at in points:
        cut = tmp_path / "cut.mcap"
        cut.write_bytes(data[:at])
        found, recording, error = read(cut)
        assert error is None, at
        assert [tuple(m) for m in found] == expected[: len(found)], at
        assert not recording.report.complete
        assert not recording.report.damaged
        assert "not finished" in recording.report.reason
        assert recording.report.messages == len(found)
        assert recording.report.bytes <= at
        lengths.add(len(found))
    assert len(lengths) > 1


@pytest.mark.parametrize("name", ["whole", "segment"])
def test_of_400_flipped_bits_what_is_read_is_right_or_refused(
    name: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    path: Path = request.getfixturevalue(name)
    data, expected = path.read_bytes(), [tuple(m) for m in interleaved(40)]
    generator = random.Random(14)
    refused = 0
    for _ in range(400):
        flipped = bytearray(data)
        flipped[generator.randrange(len(data))] ^= 1 << generator.randrange(8)
        other = tmp_path / "flipped.mcap"
        other.write_bytes(flipped)
        found, recording, error = read(other)
        assert [tuple(m) for m in found] == expected[: len(found)]
        if recording.report.complete:
            assert len(found) == len(expected)
        assert (error is None) != recording.report.damaged
        refused += not recording.report.complete
    if name == "whole":
        assert refused == 400  # the data's and the summary's checksum leave nothing out


def record_heads(data: bytes | bytearray) -> list[int]:
    """Return the positions of a file's records."""
    at, heads = len(MAGIC), []
    while at < len(data):
        heads.append(at)
        at += 9 + int.from_bytes(data[at + 1 : at + 9], "little")
    return heads


def test_no_flipped_bit_in_the_head_of_a_record_makes_the_reader_skip_messages(tmp_path: Path) -> None:
    """A chunk that became another kind of record: other readers go on with the next one."""
    segment = write_segment(tmp_path / "segments", interleaved(6), flush_every=6)
    data, expected = segment.read_bytes(), [tuple(m) for m in interleaved(6)]
    heads = record_heads(data)
    assert len(heads) > 12
    other = tmp_path / "flipped.mcap"
    for head in heads:
        for bit in range(9 * 8):
            flipped = bytearray(data)
            flipped[head + bit // 8] ^= 1 << bit % 8
            other.write_bytes(flipped)
            found, _, _ = read(other)
            assert [tuple(m) for m in found] == expected[: len(found)], (head, bit)


def test_a_chunk_that_swallows_what_follows_is_refused(segment: Path, tmp_path: Path) -> None:
    """Other readers take the chunk, skip the rest of its length, and lose the chunks in there."""
    data = bytearray(segment.read_bytes())
    first, second, third = [head for head in record_heads(data) if data[head] == CHUNK][:3]
    data[second + 1 : second + 9] = (third - second - 9).to_bytes(8, "little")
    other = tmp_path / "swallowed.mcap"
    other.write_bytes(data)
    found, _, error = read(other)
    assert error is not None
    assert len(found) == len([m for m in Recording(segment).located() if m.chunk == first])


def test_the_checksum_file_finds_each_of_400_flipped_bits(whole: Path, tmp_path: Path) -> None:
    data, generator = whole.read_bytes(), random.Random(15)
    other = tmp_path / whole.name
    (tmp_path / f"{whole.name}.sha256").write_bytes(whole.with_name(f"{whole.name}.sha256").read_bytes())
    for _ in range(400):
        flipped = bytearray(data)
        flipped[generator.randrange(len(data))] ^= 1 << generator.randrange(8)
        other.write_bytes(flipped)
        with pytest.raises(DamagedRecording, match=r"s1\.mcap"):
            check(other)


def test_a_chunk_that_was_taken_out_is_noticed(whole: Path, tmp_path: Path) -> None:
    chunks = sorted({located.chunk for located in Recording(whole).located()})
    data = whole.read_bytes()
    length = 9 + int.from_bytes(data[chunks[-1] + 1 : chunks[-1] + 9], "little")
    other = tmp_path / "short.mcap"
    other.write_bytes(data[: chunks[-1]] + data[chunks[-1] + length :])
    assert read(other)[2] is not None


def test_anything_but_a_recording_is_refused(tmp_path: Path) -> None:
    generator = random.Random(20)
    path = tmp_path / "noise.mcap"
    for i in range(300):
        noise = generator.randbytes(generator.randrange(1, 400))
        path.write_bytes([noise, MAGIC + noise, MAGIC + HEADER + noise, MAGIC + HEADER + record(6, noise)][i % 4])
        found, recording, _ = read(path)
        assert found == []
        assert not recording.report.complete
    with pytest.raises(DamagedRecording, match="cannot be read"):
        list(facts(tmp_path))


@pytest.mark.parametrize("compression", ["", "zstd", "lz4"])
def test_chunks_of_each_compression_are_read(compression: str, tmp_path: Path) -> None:
    channel = record(4, (1).to_bytes(2, "little") + bytes(2) + b"\x06\0\0\0marker" + b"\x04\0\0\0json" + bytes(4))
    message = record(5, (1).to_bytes(2, "little") + (7).to_bytes(4, "little") + bytes(16) + b"{}")
    content = channel + message
    packed = {"": bytes, "zstd": zstandard.compress, "lz4": lz4.frame.compress}[compression](content)
    path = tmp_path / "s1.mcap"
    path.write_bytes(MAGIC + HEADER + honest_chunk(content, compression, packed))
    assert read(path)[0] == [RecordedMessage("marker", 7, 0, 0, b"{}")]


BOMB = """
import sys, zlib
from pathlib import Path
from support.recordings import HEADER, MAGIC, chunk
from shift_schemas.errors import DamagedRecording
from shift_recording.mcap.reader import facts
path = Path(sys.argv[1])
try:
    list(facts(path))
except DamagedRecording as e:
    print("refused:", e)
with open("/proc/self/status") as status:  # the process' own; ru_maxrss begins with its parent's
    print(*[line.split()[1] for line in status if line.startswith("VmHWM")])
"""


def zeros(packer: object, total: int = 1_500_000_000) -> bytes:
    """Return a great many zeros, compressed piece by piece."""
    block = bytes(10_000_000)
    begin = getattr(packer, "begin", None)
    parts = [begin()] if begin else []
    parts += [packer.compress(block) for _ in range(total // len(block))]  # type: ignore[attr-defined]
    return b"".join([*parts, packer.flush()])  # type: ignore[attr-defined]


def bombs() -> dict[str, bytes]:
    """Yield recordings that claim or unpack to far more than their size."""
    packed = zeros(zstandard.ZstdCompressor(level=3).compressobj(size=1_500_000_000))
    assert len(packed) < 150_000
    wide = zstandard.ZstdCompressionParameters.from_level(1, window_log=30)
    lz = lz4.frame.LZ4FrameCompressor(block_size=lz4.frame.BLOCKSIZE_MAX4MB)
    lz4_bomb = zeros(lz, 300_000_000)  # 1 KB per 255 KB is the best that lz4 can
    return {
        "zstd, honest": chunk("zstd", packed, 1_500_000_000),
        "zstd, lying": chunk("zstd", packed, 1000),
        "zstd, lying a little": chunk("zstd", packed, 32 * 2**20),
        "zstd, wide window": chunk(
            "zstd", zeros(zstandard.ZstdCompressor(compression_params=wide).compressobj(), 100_000_000), 1000
        ),
        "lz4, honest": chunk("lz4", lz4_bomb, 300_000_000),
        "lz4, lying": chunk("lz4", lz4_bomb, 32 * 2**20),
        "plain, lying": chunk("", bytes(1000), 1_500_000_000),
        "record longer than the file": b"\x06" + (2**40).to_bytes(8, "little"),
        "large metadata": record(12, b"\x01\0\0\0a" + (3 * 10**7).to_bytes(4, "little") + bytes(3 * 10**7)),
        "many attachments": record(9, bytes(16) + bytes(8) + (2**24).to_bytes(8, "little") + bytes(2**24 + 4)) * 9,
        "dense metadata, then a large chunk": b"".join(dense_metadata(i) for i in range(4))
        + chunk("zstd", zstandard.compress(bytes(32 * 2**20)), 32 * 2**20),
        "many schemas": b"".join(
            record(3, i.to_bytes(2, "little") + bytes(8) + (10**6).to_bytes(4, "little") + bytes(10**6))
            for i in range(1, 200)
        ),
    }


def dense_metadata(number: int) -> bytes:
    """Return the record that needs most memory for its size: a great many short texts."""
    entries = b"".join(b"\3\0\0\0" + i.to_bytes(3, "little").translate(_ASCII) + bytes(4) for i in range(90_000))
    return record(12, b"\4\0\0\0" + f"{number:04}".encode() + len(entries).to_bytes(4, "little") + entries)


_ASCII = bytes(i % 128 for i in range(256))


def test_bombs_are_refused_below_256_mb_of_memory(tmp_path: Path) -> None:
    here = str(Path(__file__).parents[2])
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([here, *sys.path])}
    for name, body in bombs().items():
        path = tmp_path / "bomb.mcap"
        path.write_bytes(MAGIC + HEADER + body)
        done = subprocess.run(
            [sys.executable, "-c", BOMB, str(path)],
            capture_output=True, text=True, env=environment, timeout=60, check=True,
        )  # fmt: skip
        said, kilobytes = done.stdout.strip().splitlines()
        assert said.startswith("refused: bomb.mcap"), name
        assert int(kilobytes) < 256 * 1024, name


def test_a_large_honest_recording_is_read_in_bounded_memory(tmp_path: Path) -> None:
    """The limit is a chunk's: a file of any size is read."""
    path = finished(tmp_path, [write_segment(tmp_path / "segments", interleaved(2000), flush_every=500)]).path
    found, recording, error = read(path)
    assert (len(found), error) == (6000, None)
    assert recording.report.complete
