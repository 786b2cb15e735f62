"""Finishing: one valid recording of whatever a session left behind."""

from __future__ import annotations

import hashlib
import random
from pathlib import Path

import pytest
from mcap.reader import make_reader
from shift_recording import merging as finishing
from shift_recording.checksum import Checksum, check
from shift_recording.durable_file import DurableFile, StorageFailed
from shift_recording.mcap.reader import Recording
from shift_recording.merging import finish_recording
from shift_schemas.errors import Conflict, DamagedRecording, UnknownThing
from shift_schemas.registry import OWNER_OF
from support.recordings import (
    ATTACHMENTS,
    METADATA,
    SCHEMAS,
    Recorded,
    finished,
    interleaved,
    owner_sequences,
    write_segment,
)
from support.verify_sessions import Session


def messages(path: Path) -> list[tuple[object, ...]]:
    """Return all messages of a recording, which must be complete."""
    recording = Recording(path)
    found = [tuple(m) for m in recording.messages()]
    assert recording.report.complete
    return found


def last_chunk(path: Path) -> int:
    """Return the position of a recording's last chunk."""
    return max(located.chunk for located in Recording(path).located())


def test_the_standard_reader_takes_it_with_index_statistics_and_attachments(whole: Path) -> None:
    with open(whole, "rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_count == 120
        assert summary.statistics.chunk_count == len(summary.chunk_indexes) > 0
        assert len(list(reader.iter_messages(topics="decision"))) == 40
        first = interleaved(40)[60].log_time
        assert len(list(reader.iter_messages(starting_at=first))) == 60
        assert {a.name: a.data for a in reader.iter_attachments()} == {a.name: a.data for a in ATTACHMENTS}
        kept = {m.name: m.metadata for m in reader.iter_metadata()}
    assert kept == {
        "shift:session": {"participant": "P01", "seed": "7", "session": "s1"},
        "shift:config": METADATA["shift:config"],
    }


def test_messages_in_two_segments_are_written_once(tmp_path: Path) -> None:
    all_of_it = interleaved(40)
    late = [m._replace(log_time=m.log_time + 10**9) for m in all_of_it[50:]]
    sources = [write_segment(tmp_path / "segments", part) for part in (all_of_it[:80], late, all_of_it[100:])]
    result = finished(tmp_path, sources)
    found = messages(result.path)
    assert [f[:2] for f in found] == [m[:2] for m in all_of_it]
    assert [f[2] for f in found[50:80]] == [m.log_time for m in all_of_it[50:80]]  # as it was recorded first
    assert result.duplicates == 30 + 20
    assert result.missing == {}
    assert result.counts == {"gaze": 40, "decision": 40, "marker": 40}
    assert result.bytes == result.path.stat().st_size


@pytest.mark.parametrize("seed", range(5))
def test_each_owners_sequence_rises_however_the_segments_overlap(tmp_path: Path, seed: int) -> None:
    generator, all_of_it = random.Random(seed), interleaved(60)
    cuts = sorted(generator.sample(range(len(all_of_it)), 4))
    parts = [all_of_it[max(0, a - generator.randrange(30)) : b] for a, b in zip([0, *cuts], [*cuts, 180], strict=True)]
    found = messages(finished(tmp_path, [write_segment(tmp_path / "s", p) for p in parts if p]).path)
    expected = owner_sequences((m.subject, m.sequence) for m in all_of_it)
    assert owner_sequences((f[0], f[1]) for f in found) == expected  # type: ignore[misc]


def test_a_message_recorded_late_moves_to_before_its_successor(tmp_path: Path) -> None:
    all_of_it = interleaved(10)
    lost = [m for m in all_of_it if (m.subject, m.sequence) == ("decision", 4)]
    first = write_segment(tmp_path / "s", [m for m in all_of_it if m not in lost])
    result = finished(tmp_path, [first])
    assert result.missing == {"decider": ((4, 4),)}
    late = [m._replace(log_time=m.log_time + 10**10) for m in lost]
    again = finished(tmp_path, [result.path, write_segment(tmp_path / "s", late)])
    assert again.missing == {}
    order = [f[:2] for f in messages(again.path)]
    assert order.index(("decision", 4)) == order.index(("decision", 5)) - 1
    assert [o for o in order if o != ("decision", 4)] == [m[:2] for m in all_of_it if m not in lost]


def test_a_clock_that_jumps_back_an_hour_changes_no_order(tmp_path: Path) -> None:
    all_of_it = interleaved(20)
    jumped = [m._replace(log_time=m.log_time - 3600 * 10**9) for m in all_of_it[30:]]
    sources = [write_segment(tmp_path / "s", part) for part in ([*all_of_it[:30], *jumped[:10]], jumped[5:])]
    assert [f[:2] for f in messages(finished(tmp_path, sources).path)] == [m[:2] for m in all_of_it]


def test_facts_of_one_owner_keep_their_order_across_topics(tmp_path: Path) -> None:
    mixed = [
        Recorded("observation" if n % 3 else "gaze", n, 10**9 + n // 5, 1, b"{}") for n in range(1, 50)
    ]  # many share a log_time
    found = messages(finished(tmp_path, [write_segment(tmp_path / "s", mixed)]).path)
    assert found == [tuple(m) for m in mixed]


def test_cut_off_and_damaged_segments_give_what_came_before_and_say_so(tmp_path: Path) -> None:
    all_of_it = interleaved(40)
    cut, damaged = (write_segment(tmp_path / "s", part) for part in (all_of_it[:60], all_of_it[60:]))
    cut.write_bytes(cut.read_bytes()[: last_chunk(cut) + 200])
    data = bytearray(damaged.read_bytes())
    data[last_chunk(damaged) + 200] ^= 4
    damaged.write_bytes(data)
    result = finished(tmp_path, [cut, damaged])
    assert [(r.complete, r.damaged, r.messages) for r in result.sources] == [(False, False, 40), (False, True, 40)]
    assert [f[:2] for f in messages(result.path)] == [m[:2] for m in (*all_of_it[:40], *all_of_it[60:100])]
    assert result.missing["decider"] == ((14, 20),)


def test_a_session_without_messages_is_a_valid_recording(tmp_path: Path) -> None:
    for sources in ([], [write_segment(tmp_path / "s", [])]):
        result = finished(tmp_path, sources)
        assert (messages(result.path), result.counts, result.missing) == ([], {}, {})
        with open(result.path, "rb") as stream:
            assert make_reader(stream, validate_crcs=True).get_summary() is not None


def test_the_checksum_beside_it_is_what_sha256sum_writes(whole: Path) -> None:
    digest = hashlib.sha256(whole.read_bytes()).hexdigest()
    assert whole.with_name("s1.mcap.sha256").read_bytes() == f"{digest}  s1.mcap\n".encode()
    assert check(whole) is Checksum.MATCHES


def test_a_segment_of_another_session_is_never_mixed_in(tmp_path: Path) -> None:
    mine = write_segment(tmp_path / "s", interleaved(2))
    other = write_segment(tmp_path / "s", interleaved(2), session="s2")
    with pytest.raises(Conflict, match="s2"):
        finished(tmp_path, [mine, other])
    assert not list(tmp_path.glob("*.mcap"))


def test_a_source_that_is_not_there_is_said(tmp_path: Path) -> None:
    with pytest.raises(UnknownThing):
        finished(tmp_path, [tmp_path / "0007.mcap"])


def test_a_failure_leaves_the_earlier_recording_and_no_rest(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    source = write_segment(tmp_path / "s", interleaved(3))
    before = finished(tmp_path, [source]).path.read_bytes()

    def refuses(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("shift_recording.durable_file.os.fsync", refuses)
    with pytest.raises(StorageFailed, match="No space left"):
        finished(tmp_path, [source])
    monkeypatch.undo()
    assert (tmp_path / "s1.mcap").read_bytes() == before
    assert check(tmp_path / "s1.mcap") is Checksum.MATCHES
    assert sorted(p.name for p in tmp_path.iterdir()) == ["s", "s1.mcap", "s1.mcap.sha256"]


def test_a_crash_before_the_checksum_leaves_none_rather_than_a_wrong_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    finished(tmp_path, [write_segment(tmp_path / "s", interleaved(3))])

    def crash(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(finishing, "write_checksum", crash)
    with pytest.raises(KeyboardInterrupt):
        finished(tmp_path, [write_segment(tmp_path / "s", interleaved(4))])
    assert check(tmp_path / "s1.mcap") is Checksum.MISSING
    assert len(messages(tmp_path / "s1.mcap")) == 12


@pytest.mark.parametrize("spoil", ["cut", "flip"])
def test_file_that_is_not_read_back_as_written_does_not_take_its_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, spoil: str
) -> None:
    """A disk that loses or changes what was written is found before the end of a session is acknowledged."""
    close = DurableFile.close

    def spoilt(self: DurableFile) -> None:
        close(self)
        if self.path.name.endswith(".partial"):
            data = bytearray(self.path.read_bytes())
            data[len(data) // 2] ^= 0x10 if spoil == "flip" else 0
            self.path.write_bytes(bytes(data) if spoil == "flip" else bytes(data[: len(data) // 2]))

    monkeypatch.setattr(DurableFile, "close", spoilt)
    with pytest.raises(DamagedRecording):
        Session().interactions(5).ended().finished(tmp_path)
    assert not (tmp_path / "s1.mcap").exists()
    assert list(tmp_path.glob("**/0*.mcap")), "the segments are still there"


def test_progress_is_told_to_the_end(tmp_path: Path) -> None:
    told: list[tuple[int, int]] = []
    finish_recording(
        "s1", [write_segment(tmp_path / "s", interleaved(500))], tmp_path / "s1.mcap", schemas=SCHEMAS,
        metadata={}, attachments=(), progress=lambda done, total: told.append((done, total)),
    )  # fmt: skip
    assert told == [(1000, 1500), (1500, 1500)]


def test_a_small_cache_of_chunks_changes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    all_of_it = interleaved(40)
    odd = write_segment(tmp_path / "s", [m for m in all_of_it if OWNER_OF[m.subject] == "decider"])
    rest = write_segment(tmp_path / "s", [m for m in all_of_it if OWNER_OF[m.subject] != "decider"])
    before = finished(tmp_path, [odd, rest]).sha256
    monkeypatch.setattr(finishing, "_CACHE_BYTES", 1)
    assert finished(tmp_path, [odd, rest]).sha256 == before
