"""The ledger of a gaze source: what came, what did not, and how its clock runs beside the mesh's. Pure.

It is recorded as a ``clock`` at the end of the session. Chunks that were repeated or refused leave no other trace in
the recording; everything else in the ledger follows from the recorded chunks.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from operator import sub

from shift_schemas.messages import Clock, Seen
from shift_schemas.timestamps import NS, Stamp

SHORTEST_S = 10.0
"""Chosen: over a shorter time, the delays of single chunks are larger than the drift."""


@dataclass(frozen=True, slots=True)
class Arrivals:
    """The arrivals of one segment: sums over its chunks, s since the first one, by both clocks."""

    first_ns: int = 0
    first_stamp_ns: int = 0
    count: int = 0
    own: float = 0.0
    mesh: float = 0.0
    own_mesh: float = 0.0
    mesh_mesh: float = 0.0
    latest_mesh: float = 0.0
    offset_ns: int = 0
    """The smallest difference between the mesh's clock at an arrival and the source's clock."""


NO_ARRIVALS = Arrivals()


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


EMPTY_LEDGER = ClockLedger()


def count_applied(ledger: ClockLedger, times: list[int], missing: int, restarted: bool, now: Stamp) -> ClockLedger:
    """Return the ledger after a chunk with samples at ``times``, ns, before which so many chunks are missing."""
    last_ns = None if restarted else ledger.last_ns
    before = times if last_ns is None else [last_ns, *times]
    gap_ns = max(map(sub, before[1:], before), default=0)
    arrivals = _with_arrival(NO_ARRIVALS if restarted else ledger.arrivals, times[-1], now)
    # written out, because dataclasses.replace takes three times as long, and this runs for each chunk
    return ClockLedger(
        ledger.chunks + 1, ledger.samples + len(times), ledger.late, ledger.missing + missing,
        ledger.restarts + restarted, ledger.repeated, ledger.refused, times[-1],
        ledger.span_ns + before[-1] - before[0], max(ledger.longest_gap_ns, gap_ns), arrivals,
    )  # fmt: skip


def _with_arrival(before: Arrivals, own_ns: int, now: Stamp) -> Arrivals:
    offset_ns = now.ns - own_ns
    if before.count == 0:
        return Arrivals(own_ns, now.ns, 1, offset_ns=offset_ns)
    own, mesh = (own_ns - before.first_ns) / NS, (now.ns - before.first_stamp_ns) / NS
    return Arrivals(
        before.first_ns, before.first_stamp_ns, before.count + 1, before.own + own, before.mesh + mesh,
        before.own_mesh + own * mesh, before.mesh_mesh + mesh * mesh, mesh, min(before.offset_ns, offset_ns),
    )  # fmt: skip


def count_late(ledger: ClockLedger) -> ClockLedger:
    """Return the ledger after a chunk that came late: its number counted as missing before."""
    return replace(ledger, late=ledger.late + 1, missing=max(0, ledger.missing - 1))


def count_repeated(ledger: ClockLedger) -> ClockLedger:
    """Return the ledger after a chunk that was sent again."""
    return replace(ledger, repeated=ledger.repeated + 1)


def count_refused(ledger: ClockLedger, kind: str) -> ClockLedger:
    """Return the ledger after a refused chunk; ``kind`` is that of the error."""
    return replace(ledger, refused={**ledger.refused, kind: ledger.refused.get(kind, 0) + 1})


def clock_fact(session: str, seen: Seen, source: str, ledger: ClockLedger, now: Stamp) -> Clock:
    """Return the ledger as it is recorded."""
    arrivals, intervals = ledger.arrivals, ledger.samples - 1 - ledger.restarts
    return Clock(
        session=session, stamp=now, seen=seen, source=source, chunks=ledger.chunks, samples=ledger.samples,
        late=ledger.late, missing=ledger.missing, repeated=ledger.repeated, refused=ledger.refused,
        restarts=ledger.restarts,
        rate_hz=intervals * NS / ledger.span_ns if ledger.span_ns and intervals > 0 else None,
        longest_gap_s=ledger.longest_gap_ns / NS,
        offset_s=arrivals.offset_ns / NS if arrivals.count else None,
        drift_ppm=_drift_ppm(arrivals),
    )  # fmt: skip


def _drift_ppm(a: Arrivals) -> float | None:
    """Return how much faster the source's clock runs than the mesh's: a line through the arrivals."""
    if a.count < 3 or a.latest_mesh < SHORTEST_S:
        return None
    spread = a.count * a.mesh_mesh - a.mesh**2
    return 1e6 * ((a.count * a.own_mesh - a.own * a.mesh) / spread - 1) if spread > 0 else None
