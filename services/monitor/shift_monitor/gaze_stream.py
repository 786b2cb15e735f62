"""The samples of one gaze source, points or AOI names, applied to the partner's attention. Pure.

Samples are applied one after another, so the cut of chunks does not change the result.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from shift_schemas.messages import GazeChunk

from shift_monitor.areas import NOWHERE, area_at
from shift_monitor.attention import Attention, Dwell, apply_dwell, mark_aoi_seen
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


def apply_points(
    stream: GazeStream, attention: Attention, times: list[int], chunk: GazeChunk, prepared: PreparedStudy
) -> tuple[GazeStream, Attention, list[EndedFixation]]:
    """Apply points through fixation detection; only samples inside a fixation count as dwell."""
    found: list[EndedFixation] = []
    detector, account = stream.detector, stream.account
    kinds: list[int] = []
    for t_ns, point in zip(times, points_of(chunk), strict=True):
        kinds.append(_kind(point))
        if not attention.aoi_seen and point is not None and area_at(prepared.areas, *point) != NOWHERE:
            attention = mark_aoi_seen(attention)
        detector, output = update(detector, t_ns, point, prepared.rule)
        if output.dwells:
            attention, account = apply_fixation_dwell(attention, account, output, prepared)
        found += output.found
    account = count_samples(account, times, kinds, prepared.rule.gap_ns)
    return replace(stream, last_ns=times[-1], named=None, detector=detector, account=account), attention, found


def _kind(point: tuple[float, float] | None) -> int:
    if point is None:
        return LOST
    return ON_STIMULUS if 0.0 <= point[0] <= 1.0 and 0.0 <= point[1] <= 1.0 else OFF_STIMULUS


def apply_fixation_dwell(
    attention: Attention, account: GazeAccount, output: FixationUpdate, prepared: PreparedStudy
) -> tuple[Attention, GazeAccount]:
    """Apply the dwell of the samples inside a fixation, each on the AOI at its filtered position."""
    rule, settings = prepared.rule, prepared.study.attention
    on_aoi_ns = off_aoi_ns = 0
    for t_ns, x, y, duration_ns in output.dwells:
        target = area_at(prepared.areas, x, y)
        if target == NOWHERE:
            off_aoi_ns += duration_ns
        else:
            on_aoi_ns += duration_ns
        attention = apply_dwell(attention, Dwell(target, t_ns, duration_ns), rule.minimum_ns, rule.gap_ns, settings)
    return attention, count_dwell(account, on_aoi_ns, off_aoi_ns)


def apply_names(
    stream: GazeStream, attention: Attention, times: list[int], names: list[str | None], prepared: PreparedStudy
) -> tuple[GazeStream, Attention]:
    """Apply AOI names; each stands until the next one, at most ``attention.maximum_dwell_s``."""
    last_ns, named = stream.last_ns, stream.named
    on_aoi_ns = off_aoi_ns = 0
    for t_ns, name in zip(times, names, strict=True):
        if last_ns is not None and named is not None:
            dwell = Dwell(named, last_ns, min(t_ns - last_ns, prepared.longest_ns))
            if named == NOWHERE:
                off_aoi_ns += dwell.duration_ns
            else:
                on_aoi_ns += dwell.duration_ns
            attention = apply_dwell(attention, dwell, prepared.rule.minimum_ns, 0, prepared.study.attention)
        last_ns, named = t_ns, prepared.targets[name]
        if not attention.aoi_seen and named != NOWHERE:
            attention = mark_aoi_seen(attention)
    account = count_samples(stream.account, times, [ON_STIMULUS] * len(times), prepared.longest_ns)
    account = count_dwell(account, on_aoi_ns, off_aoi_ns)
    return replace(stream, last_ns=last_ns, named=named, account=account), attention
