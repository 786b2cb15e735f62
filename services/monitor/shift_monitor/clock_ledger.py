"""The ledger of a gaze source: what came, what did not, and how its clock runs beside the mesh's. Pure.

It is recorded as a ``clock`` at the end of the session, where a segment begins, and every ten seconds. Chunks that were
repeated or refused leave no other trace in the recording; everything else in the ledger follows from the recorded
chunks.

A segment ends where the source restarts its clock or its numbering, and where its clock jumps forward. The offset of a
segment is the smallest difference between the mesh's clock when a chunk arrived and the source's clock, because that
chunk had the shortest way. So the step between two segments is known to the length of that way.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from operator import sub
from typing import NamedTuple

from shift_schemas.messages import Clock, ClockSegment, GazeChunk, Seen
from shift_schemas.timestamps import NS, Stamp

SHORTEST_S = 10.0
"""Chosen: over a shorter time, the delays of single chunks are larger than the drift."""
LEAST_JUMP_S = 1.0
"""Chosen: a clock that is this much ahead of the mesh's after a gap jumped; networks delay chunks by less."""
RECORDED_EVERY_NS = 10_000_000_000
"""Chosen: a ledger on the page is at most this old, and costs one message in a hundred."""
MOST_SEGMENTS = 32
"""Chosen: the segments that a ledger lists; of older ones only the counts are kept."""


@dataclass(frozen=True, slots=True)
class Arrivals:
    """The arrivals of one segment: sums over the seconds of the mesh's clock, in s since the first arrival.

    Of each second, only the arrival counts that had the shortest way: it came the least late. The first second does not
    count: when a connection begins, samples that waited come late.
    """

    first_ns: int = 0
    first_stamp_ns: int = 0
    chunks: int = 0
    count: int = 0
    """Seconds that are in the sums."""
    own: float = 0.0
    mesh: float = 0.0
    own_mesh: float = 0.0
    mesh_mesh: float = 0.0
    latest_mesh: float = 0.0
    second: int = 0
    """The second that goes on."""
    least: tuple[int, float, float] | None = None
    """Its arrival with the shortest way: mesh's clock minus source's clock (ns), and the times by both clocks (s)."""
    offset_ns: int = 0
    """The smallest difference between the mesh's clock at an arrival and the source's clock."""


NO_ARRIVALS = Arrivals()


class EndedSegment(NamedTuple):
    """A segment that has ended."""

    number: int
    samples: int
    first_ns: int
    last_ns: int
    offset_ns: int
    drift_ppm: float | None


@dataclass(frozen=True, slots=True)
class ClockLedger:
    """The account of one source. ``refused`` counts chunks by the kind of the error."""

    chunks: int = 0
    samples: int = 0
    late: int = 0
    missing: int = 0
    restarts: int = 0
    repeated: int = 0
    refused: dict[str, int] = field(default_factory=dict)
    last_ns: int | None = None
    span_ns: int = 0
    """The time between samples that follow each other in a segment, all segments together."""
    longest_gap_ns: int = 0
    arrivals: Arrivals = NO_ARRIVALS
    """Those of the segment that goes on."""
    first_ns: int = 0
    """The first sample of that segment."""
    segment_samples: int = 0
    ended: tuple[EndedSegment, ...] = ()
    """The last segments before it."""
    recorded_ns: int = 0
    """When the ledger was recorded last, by the mesh's clock; before that, when its first chunk came."""
    round_trip_s: float | None = None
    source_offset_s: float | None = None


EMPTY_LEDGER = ClockLedger()


def count_applied(
    ledger: ClockLedger, chunk: GazeChunk, times: list[int], missing: int, restarted: bool, now: Stamp,
    by_second: bool = True,
) -> ClockLedger:  # fmt: skip
    """Return the ledger after a chunk with samples at ``times``, ns, before which so many chunks are missing.

    ``by_second`` is false in format 5, in which every arrival counts for the drift.
    """
    if chunk.round_trip_s is not None or chunk.offset_s is not None:
        ledger = _with_measured(ledger, chunk)
    last_ns = None if restarted else ledger.last_ns
    before = times if last_ns is None else [last_ns, *times]
    gap_ns = max(map(sub, before[1:], before), default=0)
    with_arrival = _with_arrival if by_second else _with_every_arrival
    arrivals = with_arrival(NO_ARRIVALS if restarted else ledger.arrivals, times[-1], now)
    # written out, because dataclasses.replace takes three times as long, and this runs for each chunk
    return ClockLedger(
        ledger.chunks + 1, ledger.samples + len(times), ledger.late, ledger.missing + missing,
        ledger.restarts + restarted, ledger.repeated, ledger.refused, times[-1],
        ledger.span_ns + before[-1] - before[0], max(ledger.longest_gap_ns, gap_ns), arrivals,
        times[0] if last_ns is None else ledger.first_ns,
        len(times) + (0 if last_ns is None else ledger.segment_samples),
        (*ledger.ended, _ended(ledger))[-MOST_SEGMENTS:] if restarted and ledger.chunks else ledger.ended,
        ledger.recorded_ns or now.ns, ledger.round_trip_s, ledger.source_offset_s,
    )  # fmt: skip


def _with_measured(ledger: ClockLedger, chunk: GazeChunk) -> ClockLedger:
    """Return the ledger with what the source measured of its own clock."""
    trips = [trip for trip in (ledger.round_trip_s, chunk.round_trip_s) if trip is not None]
    offset_s = ledger.source_offset_s if chunk.offset_s is None else chunk.offset_s
    return replace(ledger, round_trip_s=min(trips, default=None), source_offset_s=offset_s)


def _ended(ledger: ClockLedger) -> EndedSegment:
    """Return the segment that goes on as one that ends."""
    return EndedSegment(
        ledger.restarts, ledger.segment_samples, ledger.first_ns, ledger.last_ns or 0, ledger.arrivals.offset_ns,
        _drift_ppm(ledger.arrivals),
    )  # fmt: skip


def jumps_forward(ledger: ClockLedger, times: list[int], now: Stamp) -> bool:
    """Return whether the source's clock jumped before or within a chunk that arrives now.

    Between two samples, the source's clock then went on by more than the mesh's clock did since the last chunk, at the
    pace of the segment so far: a source that plays faster than real time has another pace.
    """
    arrivals = ledger.arrivals
    if ledger.last_ns is None or arrivals.chunks < 2 or arrivals.latest_mesh < LEAST_JUMP_S:
        return False
    gap_ns = max(map(sub, times, [ledger.last_ns, *times]))
    own = (ledger.last_ns - arrivals.first_ns) / NS
    pace = arrivals.latest_mesh / own if own > 0 else 1.0
    passed = (now.ns - arrivals.first_stamp_ns) / NS - arrivals.latest_mesh
    return bool(pace * gap_ns / NS - passed > LEAST_JUMP_S)


def is_due(ledger: ClockLedger, restarted: bool, now: Stamp) -> bool:
    """Return whether the ledger is recorded after a chunk."""
    return restarted or now.ns - ledger.recorded_ns >= RECORDED_EVERY_NS


def _with_arrival(before: Arrivals, own_ns: int, now: Stamp) -> Arrivals:
    offset_ns = now.ns - own_ns
    if before.chunks == 0:
        return Arrivals(own_ns, now.ns, 1, least=(offset_ns, 0.0, 0.0), offset_ns=offset_ns)
    own, mesh = (own_ns - before.first_ns) / NS, (now.ns - before.first_stamp_ns) / NS
    count, sums, second, least = before.count, _sums(before), int(mesh), before.least
    if second != before.second and least is not None:
        if before.second > 0:
            count, sums = count + 1, _added(sums, *least[1:])
        least = None
    if least is None or offset_ns < least[0]:
        least = offset_ns, own, mesh
    return Arrivals(
        before.first_ns, before.first_stamp_ns, before.chunks + 1, count, *sums, mesh, second, least,
        min(before.offset_ns, offset_ns),
    )  # fmt: skip


def _with_every_arrival(before: Arrivals, own_ns: int, now: Stamp) -> Arrivals:
    """Return the arrivals of format 5: each one is in the sums, and ``chunks`` is not counted."""
    offset_ns = now.ns - own_ns
    if before.count == 0:
        return Arrivals(own_ns, now.ns, count=1, offset_ns=offset_ns)
    own, mesh = (own_ns - before.first_ns) / NS, (now.ns - before.first_stamp_ns) / NS
    return Arrivals(
        before.first_ns, before.first_stamp_ns, 0, before.count + 1, *_added(_sums(before), own, mesh), mesh,
        offset_ns=min(before.offset_ns, offset_ns),
    )  # fmt: skip


def _sums(a: Arrivals) -> tuple[float, float, float, float]:
    return a.own, a.mesh, a.own_mesh, a.mesh_mesh


def _added(sums: tuple[float, float, float, float], own: float, mesh: float) -> tuple[float, float, float, float]:
    return sums[0] + own, sums[1] + mesh, sums[2] + own * mesh, sums[3] + mesh * mesh


def count_late(ledger: ClockLedger) -> ClockLedger:
    """Return the ledger after a chunk that came late: its number counted as missing before."""
    return replace(ledger, late=ledger.late + 1, missing=max(0, ledger.missing - 1))


def count_repeated(ledger: ClockLedger) -> ClockLedger:
    """Return the ledger after a chunk that was sent again."""
    return replace(ledger, repeated=ledger.repeated + 1)


def count_refused(ledger: ClockLedger, kind: str) -> ClockLedger:
    """Return the ledger after a refused chunk; ``kind`` is that of the error."""
    return replace(ledger, refused={**ledger.refused, kind: ledger.refused.get(kind, 0) + 1})


def clock_fact(
    session: str, seen: Seen, source: str, ledger: ClockLedger, now: Stamp, with_segments: bool = True
) -> Clock:
    """Return the ledger as it is recorded; ``with_segments`` from format 6 on."""
    arrivals, intervals = ledger.arrivals, ledger.samples - 1 - ledger.restarts
    return Clock(
        session=session, stamp=now, seen=seen, source=source, chunks=ledger.chunks, samples=ledger.samples,
        late=ledger.late, missing=ledger.missing, repeated=ledger.repeated, refused=ledger.refused,
        restarts=ledger.restarts,
        rate_hz=intervals * NS / ledger.span_ns if ledger.span_ns and intervals > 0 else None,
        longest_gap_s=ledger.longest_gap_ns / NS,
        offset_s=arrivals.offset_ns / NS if arrivals.chunks or arrivals.count else None,
        drift_ppm=_drift_ppm(arrivals),
        round_trip_s=ledger.round_trip_s, source_offset_s=ledger.source_offset_s,
        segments=_segments(ledger) if with_segments else None,
    )  # fmt: skip


def mark_recorded(ledger: ClockLedger, now: Stamp) -> ClockLedger:
    """Return the ledger after it was recorded."""
    return replace(ledger, recorded_ns=now.ns)


def _segments(ledger: ClockLedger) -> list[ClockSegment]:
    found: list[ClockSegment] = []
    before: EndedSegment | None = None
    for ended in (*ledger.ended, *([_ended(ledger)] if ledger.chunks else [])):
        found.append(
            ClockSegment(
                segment=ended.number, samples=ended.samples, start_s=ended.first_ns / NS, end_s=ended.last_ns / NS,
                offset_s=ended.offset_ns / NS, drift_ppm=ended.drift_ppm,
                step_s=0.0 if before is None else (before.offset_ns - ended.offset_ns) / NS,
            )
        )  # fmt: skip
        before = ended
    return found


def _drift_ppm(a: Arrivals) -> float | None:
    """Return how much faster the source's clock runs than the mesh's: a line through the least late arrivals."""
    if a.count < 3 or a.latest_mesh < SHORTEST_S:
        return None
    spread = a.count * a.mesh_mesh - a.mesh**2
    return 1e6 * ((a.count * a.own_mesh - a.own * a.mesh) / spread - 1) if spread > 0 else None
