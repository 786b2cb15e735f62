"""The quality of the recorded gaze, by source: rate, loss, gaps, restarts, and how its clock runs. Pure."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from shift_schemas.messages import Gaze
from shift_schemas.timestamps import NS

GAP_S = 0.1
"""An interval between two samples is a gap if it is longer than this and than three usual intervals. A choice."""
MOST_POINTS = 100_000
"""So many intervals and chunks of a source are looked at for its rate and its clock; the others are counted alone."""


@dataclass(frozen=True)
class SourceQuality:
    """The gaze of one source. Shares are 0..1 of its samples; a value that cannot be known is None."""

    source: str
    samples: int
    segments: int
    """How often its clock or its numbering began anew, plus 1."""
    late_chunks: int
    """Chunks that came after a later one; they are recorded and not applied."""
    missing_chunks: int
    """Numbers that are left out; their chunks never came."""
    rate_hz: float | None
    """One over the median interval."""
    lost: float | None
    """Invalid samples; None for gaze on AOIs."""
    on_aoi: float | None
    """Samples on an AOI; None for points, whose AOI depends on the study."""
    gaps: int
    longest_gap_s: float
    drift_ppm: float | None
    """How much faster the source's clock runs than the mesh's, millionths: a line through all chunks of the longest
    segment. None for less than 10 s."""
    delay_spread_s: float | None
    """Standard deviation of the chunks' delays around that line, s."""

    def as_json(self) -> dict[str, Any]:
        """Return the values for ``--json``."""
        return asdict(self)


@dataclass
class _Source:
    samples: int = 0
    invalid: int = 0
    named: int = 0
    named_on_aoi: int = 0
    late: int = 0
    numbers: dict[int, list[int]] = field(default_factory=dict)
    """By segment, the smallest and the largest number of a chunk, and how many there are."""
    intervals: list[float] = field(default_factory=list)
    arrivals: dict[int, list[tuple[float, float]]] = field(default_factory=dict)
    """By segment, the last time of each chunk and its stamp, s."""
    last_t: tuple[int, float] | None = None


class GazeQuality:
    """Folds chunks of gaze, in their order."""

    def __init__(self) -> None:
        self._sources: dict[str, _Source] = {}

    def add(self, chunk: Gaze) -> None:
        """Add a chunk."""
        source = self._sources.setdefault(chunk.source, _Source())
        source.samples += len(chunk.t)
        source.invalid += chunk.valid.count(False)
        source.named += len(chunk.aoi)
        source.named_on_aoi += sum(map(bool, chunk.aoi))
        first, last, count = source.numbers.setdefault(chunk.segment, [chunk.seq, chunk.seq, 0])
        source.numbers[chunk.segment] = [min(first, chunk.seq), max(last, chunk.seq), count + 1]
        if chunk.outcome != "applied":
            source.late += 1
            return
        if len(source.intervals) < MOST_POINTS:
            before = [source.last_t[1]] if source.last_t and source.last_t[0] == chunk.segment else []
            source.intervals += np.diff([*before, *chunk.t]).tolist()
        source.last_t = chunk.segment, chunk.t[-1]
        arrivals = source.arrivals.setdefault(chunk.segment, [])
        if len(arrivals) < MOST_POINTS:
            arrivals.append((chunk.t[-1], chunk.stamp.ns / NS))

    def sources(self) -> list[SourceQuality]:
        """Return the quality of each source, in the order of their first chunks."""
        return [_quality(name, source) for name, source in self._sources.items()]


def quality_of(chunks: Iterable[Gaze]) -> list[SourceQuality]:
    """Return the quality of each source in these chunks."""
    quality = GazeQuality()
    for chunk in chunks:
        quality.add(chunk)
    return quality.sources()


def _quality(name: str, source: _Source) -> SourceQuality:
    rising = [interval for interval in source.intervals if interval > 0]
    usual = float(np.median(rising)) if rising else None
    gaps = [interval for interval in rising if usual is not None and interval > max(GAP_S, 3 * usual)]
    points = source.samples - source.named
    drift, spread = _clock(max(source.arrivals.values(), key=len, default=[]))
    return SourceQuality(
        source=name,
        samples=source.samples,
        segments=len(source.numbers),
        late_chunks=source.late,
        missing_chunks=sum(last - first + 1 - count for first, last, count in source.numbers.values()),
        rate_hz=1 / usual if usual else None,
        lost=source.invalid / points if points else None,
        on_aoi=source.named_on_aoi / source.named if source.named else None,
        gaps=len(gaps),
        longest_gap_s=max(gaps, default=0.0),
        drift_ppm=drift,
        delay_spread_s=spread,
    )


def _clock(arrivals: list[tuple[float, float]]) -> tuple[float | None, float | None]:
    """Return drift, millionths, and spread of the delays, s, of one segment."""
    if len(arrivals) < 3 or arrivals[-1][0] - arrivals[0][0] < 10:
        return None, None
    t, stamps = (np.array(column) for column in zip(*arrivals, strict=True))
    own, mesh = t - t[0], stamps - stamps[0]
    slope, offset = np.polyfit(mesh, own, 1)
    return float(1e6 * (slope - 1)), float(np.std(own - (slope * mesh + offset)))
