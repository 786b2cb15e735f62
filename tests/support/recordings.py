"""Sessions to record: facts as the services would put them out, small and larger ones."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from shift_recording.mcap.records import Attachment
from shift_recording.mcap.schemas import recorded_json, subject_schemas
from shift_recording.merging import FinishedRecording, finish_recording
from shift_recording.segments import SegmentWriter
from shift_schemas.messages import Decision, Fact, Gaze, Marker, TripleView, Versions
from shift_schemas.registry import OWNER_OF
from shift_schemas.timestamps import Stamp
from shift_study.study import Study

START = 1_700_000_000_000_000_000
SCHEMAS = subject_schemas(Study(study="coffee"))
ATTACHMENTS = (
    Attachment("study.json", "application/json", b'{"study": "coffee"}', START),
    Attachment("policy-first.json", "application/json", b"{}", START),
)
METADATA = {"shift:session": {"participant": "P01", "seed": "7"}, "shift:config": {"study": "{}"}}


class Recorded(NamedTuple):
    """A message as it is handed to a segment."""

    subject: str
    sequence: int
    log_time: int
    publish_time: int
    data: bytes


def gaze_fact(n: int, samples: int = 10) -> Gaze:
    """Return the ``n``-th chunk of gaze at 300 Hz."""
    t = [(n * samples + i) / 300 for i in range(samples)]
    x = [((n * 7919 + i * 104729) % 1000) / 1000 for i in range(samples)]
    valid = [True] * samples
    return Gaze(session="s1", stamp=Stamp.of(START + n), source="tx300", seq=n, t=t, x=x, y=x, valid=valid)


def decision_fact(n: int, propensity: float | None = None) -> Decision:
    """Return the ``n``-th decision; without a propensity it follows an override."""
    strategy = {"negation": "affirmation", "hesitation": "none"}
    return Decision(
        session="s1", stamp=Stamp.of(START + n), decision_id=f"d{n}", task="grasp", n=n, strategy=strategy,
        observation=TripleView(capacity="high", gaze="focused", awareness="unknown"), scores={"negation": 1 / 3},
        cognitive_state="engaged_observer", suggested=strategy, actions=[strategy], probabilities=[1.0],
        propensity=propensity, explored=False, policy_source="learner", stale=False, state="engaged_observer",
        versions=Versions(observation=n, policy=n, config=1), seed=7,
    )  # fmt: skip


def marker_fact(n: int) -> Marker:
    """Return the ``n``-th marker."""
    return Marker(session="s1", stamp=Stamp.of(START + n), marker_id=f"m{n}", text=f"note {n}")


def interleaved(rounds: int, start: int = 1) -> list[Recorded]:
    """Return rounds of a chunk of gaze, a decision and a marker; each owner counts from ``start``."""
    facts: list[tuple[int, Fact]] = []
    for n in range(start, start + rounds):
        facts += [(n, gaze_fact(n)), (n, decision_fact(n, 0.5 if n % 2 else None)), (n, marker_fact(n))]
    first = START + 3_000_000 * start
    return [
        Recorded(f.subject, n, first + 1_000_000 * i, f.stamp.ns, recorded_json(f)) for i, (n, f) in enumerate(facts)
    ]


def write_segment(
    folder: Path, messages: Iterable[Recorded], *, flush_every: int = 20, finish: bool = False, session: str = "s1"
) -> Path:
    """Write and flush ``messages`` to a segment; without ``finish`` it stays as a crash leaves it."""
    segment = SegmentWriter(folder, session, SCHEMAS)
    for i, message in enumerate(messages, start=1):
        segment.write(*message)
        if i % flush_every == 0:
            segment.flush()
    segment.flush()
    segment.finish() if finish else segment.abandon()
    return segment.path


def finished(folder: Path, sources: list[Path], name: str = "s1.mcap") -> FinishedRecording:
    """Merge ``sources`` into one recording."""
    return finish_recording("s1", sources, folder / name, schemas=SCHEMAS, metadata=METADATA, attachments=ATTACHMENTS)


def owner_sequences(messages: Iterable[tuple[str, int]]) -> dict[str, list[int]]:
    """Return topic and sequence pairs by owner, in their order."""
    found: dict[str, list[int]] = {}
    for topic, sequence in messages:
        found.setdefault(OWNER_OF[topic], []).append(sequence)
    return found


def record(opcode: int, body: bytes) -> bytes:
    """Return an MCAP record."""
    return struct.pack("<BQ", opcode, len(body)) + body


def chunk(compression: str, packed: bytes, claimed: int, crc: int = 0) -> bytes:
    """Return a chunk record that claims to unpack to ``claimed`` bytes."""
    name = compression.encode()
    head = struct.pack("<QQQII", 0, 0, claimed, crc, len(name)) + name
    return record(6, head + struct.pack("<Q", len(packed)) + packed)


MAGIC = b"\x89MCAP0\r\n"
HEADER = record(1, struct.pack("<II", 0, 0))


def honest_chunk(content: bytes, compression: str = "", packed: bytes | None = None) -> bytes:
    """Return a chunk record with the right size and checksum."""
    return chunk(compression, content if packed is None else packed, len(content), zlib.crc32(content))
