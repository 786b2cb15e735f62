"""The ledgers of the gaze sources as the desk view shows them. Pure."""

from __future__ import annotations

from collections.abc import Mapping

from shift_schemas.messages import Clock

from shift_gateway.web.table_rows import Cell, Heading, Row

HEADINGS = (
    "source", Heading("samples", "Samples that were applied, and the chunks that they came in."),
    Heading("rate", "Samples per second of the source's clock."),
    Heading("longest gap", "The longest time between two samples of a segment."),
    Heading("not applied", "Chunks that came late, never came, came again, or were refused."),
    Heading("segments", "How often the source's clock or numbering began anew, and by how much its clock was set."),
    Heading("offset", "The mesh's clock minus the source's clock: the smallest of the last segment."),
    Heading("drift", "How much faster the source's clock runs than the mesh's, a line through all arrivals."),
    Heading("round trip", "The smallest round trip to the tracker, if the source measured one."),
)  # fmt: skip
NOTHING = "–"
LEAST_STEP_S = 0.05
"""A smaller step is the delay of a chunk; chosen."""


def clock_rows(ledgers: Mapping[str, Clock]) -> list[Row]:
    """Return a row for each source, the newest source last."""
    if not ledgers:
        return [Row(["no ledger yet: the first one comes after ten seconds of gaze", *[""] * (len(HEADINGS) - 1)])]
    return [_row(clock) for clock in ledgers.values()]


def _row(clock: Clock) -> Row:
    lost = (("late", clock.late), ("missing", clock.missing), ("repeated", clock.repeated))
    counts = [f"{count} {name}" for name, count in lost if count]
    counts += [f"{count} refused ({kind})" for kind, count in clock.refused.items() if count]
    steps = [f"{s.step_s:+.3f} s" for s in (clock.segments or [])[1:] if abs(s.step_s) >= LEAST_STEP_S]
    return Row(
        [
            clock.source,
            Cell(str(clock.samples), small=f"{clock.chunks} chunks"),
            NOTHING if clock.rate_hz is None else f"{clock.rate_hz:.1f} Hz",
            f"{clock.longest_gap_s:.3g} s",
            ", ".join(counts) or "none",
            Cell(str(clock.restarts + 1), small=", ".join(steps[-4:])),
            NOTHING if clock.offset_s is None else f"{clock.offset_s:.3f} s",
            NOTHING if clock.drift_ppm is None else f"{clock.drift_ppm:+.0f} ppm",
            NOTHING if clock.round_trip_s is None else f"{1000 * clock.round_trip_s:.1f} ms",
        ],
        f"clock-{clock.source}",
    )
