"""The samples of one gaze source, points or AOI names, applied to the partner's attention. Pure.

The result is that of the samples one after another, so the cut of chunks does not change it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import repeat

from shift_schemas.messages import GazeChunk
from shift_study.area_geometry import NOWHERE, area_at
from shift_study.moving_areas import AreasOverTime

from shift_monitor.attention import Attention, Dwell, apply_dwells, mark_aoi_seen
from shift_monitor.chunk_sequence import ChunkSequence
from shift_monitor.fixation import Detector, EndedFixation, FixationUpdate, update
from shift_monitor.gaze_account import (
    EMPTY_ACCOUNT,
    LOST,
    OFF_STIMULUS,
    ON_STIMULUS,
    GazeAccount,
    count_dwell,
    count_samples,
)
from shift_monitor.gaze_columns import points_of
from shift_monitor.prepared_study import PreparedStudy
from shift_monitor.recent_samples import NO_SAMPLES, RecentSamples, count_recent

UNREAD, IDLE = ChunkSequence(), Detector()
"""The sequence and the detector of a source before its first chunk."""


@dataclass(frozen=True, slots=True)
class GazeStream:
    """The state of the gaze source that is in use."""

    source: str
    numbering: ChunkSequence = UNREAD
    last_ns: int | None = None
    """The time of its last sample."""
    named: int | None = None
    """The target of the last sample if it was an AOI name; None if it was a point."""
    detector: Detector = IDLE
    segment: int = 0
    """The number of restarts of its clock or its numbering."""
    account: GazeAccount = EMPTY_ACCOUNT
    spacings: tuple[int, ...] = ()
    """The last spacings of its samples, ns."""
    recent: RecentSamples = NO_SAMPLES
    """How many of its last samples were valid."""


def apply_points(
    stream: GazeStream, attention: Attention, times: list[int], chunk: GazeChunk, prepared: PreparedStudy,
    areas: AreasOverTime,
) -> tuple[GazeStream, Attention, list[EndedFixation]]:  # fmt: skip
    """Apply points through fixation detection; only samples inside a fixation count as dwell."""
    points = points_of(chunk)
    if not attention.aoi_seen and any(
        p is not None and area_at(areas.at(t_ns), *p) != NOWHERE for t_ns, p in zip(times, points, strict=True)
    ):
        attention = mark_aoi_seen(attention)
    detector, output = update(stream.detector, zip(times, points, strict=True), prepared.rule)
    attention, account = apply_fixation_dwell(attention, stream.account, output, prepared, areas)
    account = count_samples(account, times, map(_kind, points), prepared.rule.gap_ns)
    recent = count_recent(stream.recent, times, [p is not None for p in points])
    after = GazeStream(
        stream.source, stream.numbering, times[-1], None, detector, stream.segment, account, stream.spacings, recent
    )
    return after, attention, output.found


def _kind(point: tuple[float, float] | None) -> int:
    if point is None:
        return LOST
    return ON_STIMULUS if 0.0 <= point[0] <= 1.0 and 0.0 <= point[1] <= 1.0 else OFF_STIMULUS


def apply_fixation_dwell(
    attention: Attention, account: GazeAccount, output: FixationUpdate, prepared: PreparedStudy, areas: AreasOverTime
) -> tuple[Attention, GazeAccount]:
    """Apply the dwell of the samples inside a fixation, each on the AOI that was at its filtered position then."""
    first, at = areas.first, areas.at
    if areas.layouts:
        dwells = [Dwell(area_at(at(t_ns), x, y), t_ns, duration_ns) for t_ns, x, y, duration_ns in output.dwells]
    else:  # written out: most studies have AOIs that stand still, and this runs for each sample
        dwells = [Dwell(area_at(first, x, y), t_ns, duration_ns) for t_ns, x, y, duration_ns in output.dwells]
    return _apply(dwells, attention, account, prepared, gap_ns=prepared.rule.gap_ns)


def oldest_waiting_ns(stream: GazeStream) -> int | None:
    """Return the time of the oldest sample that is not tested against areas yet, ns; None before the first sample.

    Samples wait in the median filter, and as candidates of a fixation. Without any, it is the last sample's time.
    """
    filter, candidate = stream.detector.filter, stream.detector.candidate
    waiting = [filter.points[-filter.waiting][0]] if filter.waiting else []
    return min([*waiting, *(point[0] for point in candidate[:1])], default=stream.last_ns)


def oldest_needed_ns(stream: GazeStream) -> int | None:
    """Return the earliest time at which areas are still needed, ns: also those of the fixation that goes on."""
    oldest, open_ = oldest_waiting_ns(stream), stream.detector.open
    return oldest if open_ is None or oldest is None else min(oldest, open_.start_ns)


def apply_names(
    stream: GazeStream, attention: Attention, times: list[int], names: list[str | None], prepared: PreparedStudy
) -> tuple[GazeStream, Attention]:
    """Apply AOI names; each stands until the next one, at most ``attention.maximum_dwell_s``."""
    last_ns, named, longest_ns = stream.last_ns, stream.named, prepared.longest_ns
    dwells: list[Dwell] = []
    for t_ns, name in zip(times, names, strict=True):
        if last_ns is not None and named is not None:
            dwells.append(Dwell(named, last_ns, min(t_ns - last_ns, longest_ns)))
        last_ns, named = t_ns, prepared.targets[name]
        if not attention.aoi_seen and named != NOWHERE:
            attention = mark_aoi_seen(attention)
    attention, account = _apply(dwells, attention, stream.account, prepared, gap_ns=0)
    account = count_samples(account, times, repeat(ON_STIMULUS, len(times)), longest_ns)
    recent = count_recent(stream.recent, times, [True] * len(times))
    return replace(stream, last_ns=last_ns, named=named, account=account, recent=recent), attention


def _apply(
    dwells: list[Dwell], attention: Attention, account: GazeAccount, prepared: PreparedStudy, gap_ns: int
) -> tuple[Attention, GazeAccount]:
    """Apply dwells to the attention, and count them."""
    if not dwells:
        return attention, account
    total_ns = sum([d.duration_ns for d in dwells])
    off_aoi_ns = sum([d.duration_ns for d in dwells if d.target == NOWHERE])
    after = apply_dwells(attention, dwells, prepared.rule.minimum_ns, gap_ns, prepared.study.attention)
    return after, count_dwell(account, total_ns - off_aoi_ns, off_aoi_ns)
