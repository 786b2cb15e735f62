"""The fold over gaze sample by sample, as an oracle: slow, with a new value for each step, and easy to check.

The monitor folds a whole chunk at once (``shift_monitor.gaze_stream``). Tests compare the two to the last bit.
"""

from __future__ import annotations

from dataclasses import replace

from shift_model.attention import lowered_focus_shift, next_weights, raised_focus_shift
from shift_monitor.attention import Attention
from shift_monitor.fixation import (
    LONGEST_CANDIDATE,
    Detector,
    EndedFixation,
    FixationRule,
    FixationUpdate,
    OpenFixation,
    dispersion_deg,
)
from shift_monitor.gaze_account import LOST, OFF_STIMULUS, ON_STIMULUS, GazeAccount, count_dwell, count_samples
from shift_monitor.gaze_stream import GazeStream
from shift_monitor.median import LONGEST_WINDOW, MedianWindow, Point
from shift_monitor.prepared_study import PreparedStudy
from shift_monitor.recent_samples import count_recent
from shift_schemas.messages import GazeChunk
from shift_schemas.timestamps import NS
from shift_study.area_geometry import NOWHERE, Area, area_at
from shift_study.constants import AttentionSettings
from shift_study.moving_areas import AreasOverTime

EMPTY = MedianWindow()


def apply_points(
    stream: GazeStream, attention: Attention, times: list[int], chunk: GazeChunk, prepared: PreparedStudy,
    areas: AreasOverTime,
) -> tuple[GazeStream, Attention, list[EndedFixation]]:  # fmt: skip
    """Apply points one after another, as ``shift_monitor.gaze_stream.apply_points`` does all at once."""
    found: list[EndedFixation] = []
    detector, account = stream.detector, stream.account
    kinds: list[int] = []
    for i, t_ns in enumerate(times):
        point = _point(chunk, i)
        kinds.append(_kind(point))
        if point is not None and area_at(areas_at_time(areas, t_ns), *point) != NOWHERE:
            attention = attention._replace(aoi_seen=True)
        detector, output = update(detector, t_ns, point, prepared.rule)
        attention, account = _apply_fixation_dwell(attention, account, output, prepared, areas)
        found += output.found
    account = count_samples(account, times, kinds, prepared.rule.gap_ns)
    recent = stream.recent
    for i, t_ns in enumerate(times):
        recent = count_recent(recent, [t_ns], [_point(chunk, i) is not None])
    after = replace(stream, last_ns=times[-1], named=None, detector=detector, account=account, recent=recent)
    return after, attention, found


def _point(chunk: GazeChunk, i: int) -> tuple[float, float] | None:
    assert chunk.x is not None
    assert chunk.y is not None
    x, y = chunk.x[i], chunk.y[i]
    valid = chunk.valid is None or chunk.valid[i]
    return (x, y) if valid and x is not None and y is not None else None


def _kind(point: tuple[float, float] | None) -> int:
    if point is None:
        return LOST
    return ON_STIMULUS if 0.0 <= point[0] <= 1.0 and 0.0 <= point[1] <= 1.0 else OFF_STIMULUS


def areas_at_time(areas: AreasOverTime, t_ns: int) -> tuple[Area, ...]:
    """Return the areas of the last layout that began by then."""
    held = areas.first
    for since_ns, layout in areas.layouts:
        if since_ns <= t_ns:
            held = layout
    return held


def _apply_fixation_dwell(
    attention: Attention, account: GazeAccount, output: FixationUpdate, prepared: PreparedStudy, areas: AreasOverTime
) -> tuple[Attention, GazeAccount]:
    """Apply the dwell of the samples inside a fixation, each on the AOI at its filtered position."""
    rule, settings = prepared.rule, prepared.study.attention
    on_aoi_ns = off_aoi_ns = 0
    for t_ns, x, y, duration_ns in output.dwells:
        target = area_at(areas_at_time(areas, t_ns), x, y)
        if target == NOWHERE:
            off_aoi_ns += duration_ns
        else:
            on_aoi_ns += duration_ns
        attention = apply_dwell(attention, target, t_ns, duration_ns, rule, settings)
    return attention, count_dwell(account, on_aoi_ns, off_aoi_ns)


def apply_dwell(
    attention: Attention, target: int, start_ns: int, duration_ns: int, rule: FixationRule, settings: AttentionSettings
) -> Attention:
    """Return the attention after a dwell on one target."""
    hold_ns, gap_ns = rule.minimum_ns, rule.gap_ns
    unbroken = (
        target == attention.run_target and attention.until_ns is not None and start_ns - attention.until_ns <= gap_ns
    )
    run_ns = (attention.run_ns if unbroken else 0) + duration_ns
    held, shift, held_ns = attention.held, attention.focus_shift, duration_ns
    if target != held:
        held_ns = run_ns - hold_ns
        if held_ns >= 0:
            shift = _shift_after_change(shift, held, settings)
            held = target
    weights, dwell_ns = attention.weights, attention.dwell_ns
    if target != NOWHERE:
        dwell_ns += duration_ns
        applications = duration_ns / NS / settings.step_s
        weights = next_weights(weights, target, settings.weight_step * applications, settings.weight_min)
        if target == held:
            shift = lowered_focus_shift(shift, settings.shift_decrease * (held_ns / NS / settings.step_s))
    return Attention(
        weights, shift, held, target, min(run_ns, hold_ns), start_ns + duration_ns, attention.aoi_seen, dwell_ns
    )  # fmt: skip


def _shift_after_change(shift: float, held: int, settings: AttentionSettings) -> float:
    """Return the focus shift after a change of target; the first target and the return from none change nothing."""
    return shift if held == NOWHERE else raised_focus_shift(shift, settings.shift_increase)


def update(
    detector: Detector, t_ns: int, point: tuple[float, float] | None, rule: FixationRule
) -> tuple[Detector, FixationUpdate]:
    """Return the detector after one more sample, and the sample's result.

    Parameters
    ----------
    t_ns
        The sample's time; it is later than the time of every sample before.
    point
        The position on the stimulus (0..1), or None for a lost sample.
    """
    output = FixationUpdate([], [])
    filter, covered_ns = detector.filter, detector.covered_ns
    if covered_ns is None and detector.last_ns is not None and filter.points:
        duration_ns = min(t_ns - detector.last_ns, rule.gap_ns)
        covered_ns = detector.last_ns + duration_ns
        filter = set_duration(filter, duration_ns)
    candidate, open_ = detector.candidate, detector.open
    if covered_ns is not None and t_ns - covered_ns > rule.gap_ns:
        _finish(filter, candidate, open_, rule, output)
        filter, candidate, open_ = EMPTY, (), None
    if point is not None:
        filter = push(filter, (t_ns, *point, 0))
        covered_ns = None
    filter, ready = pop_ready(filter, t_ns, rule.half_filter_ns)
    for filtered in ready:
        candidate, open_ = _detect(candidate, open_, filtered, rule, output)
    return Detector(t_ns, covered_ns, filter, candidate, open_), output


def _finish(
    filter: MedianWindow,
    candidate: tuple[Point, ...],
    open_: OpenFixation | None,
    rule: FixationRule,
    output: FixationUpdate,
) -> None:
    for filtered in flush(filter, rule.half_filter_ns):
        candidate, open_ = _detect(candidate, open_, filtered, rule, output)
    if open_ is not None:
        output.found.append(_close(open_))


def _detect(
    candidate: tuple[Point, ...], open_: OpenFixation | None, point: Point, rule: FixationRule, output: FixationUpdate
) -> tuple[tuple[Point, ...], OpenFixation | None]:
    """Make one step of I-DT with a filtered sample."""
    if open_ is not None:
        longer = _extend(open_, point)
        if _is_small(longer, rule):
            output.dwells.append(point)
            return (), longer
        output.found.append(_close(open_))
    return _search((*candidate, point)[-LONGEST_CANDIDATE:], rule, output)


def _search(
    candidate: tuple[Point, ...], rule: FixationRule, output: FixationUpdate
) -> tuple[tuple[Point, ...], OpenFixation | None]:
    """Open a fixation where the window that covers the minimum duration is small; else drop its first sample.

    Chosen: a fixation has at least two samples, since a single one says nothing about dispersion.
    """
    while len(candidate) > 1 and candidate[-1][0] + candidate[-1][3] - candidate[0][0] >= rule.minimum_ns:
        found = _open(candidate)
        if _is_small(found, rule):
            output.dwells.extend(candidate)
            return (), found
        candidate = candidate[1:]
    return candidate, None


def _open(points: tuple[Point, ...]) -> OpenFixation:
    xs, ys = [p[1] for p in points], [p[2] for p in points]
    end_ns = points[-1][0] + points[-1][3]
    return OpenFixation(
        points[0][0], end_ns, len(points), sum(xs), sum(ys), min(xs), max(xs), min(ys), max(ys)
    )  # fmt: skip


def _extend(o: OpenFixation, point: Point) -> OpenFixation:
    t_ns, x, y, duration_ns = point
    return OpenFixation(
        o.start_ns, t_ns + duration_ns, o.samples + 1, o.sum_x + x, o.sum_y + y,
        x if x < o.left else o.left, x if x > o.right else o.right,
        y if y < o.top else o.top, y if y > o.bottom else o.bottom,
    )  # fmt: skip


def _is_small(o: OpenFixation, rule: FixationRule) -> bool:
    return dispersion_deg(o.left, o.right, o.top, o.bottom, rule) <= rule.dispersion_deg


def _close(o: OpenFixation) -> EndedFixation:
    return EndedFixation(o.start_ns, o.end_ns, o.sum_x / o.samples, o.sum_y / o.samples)


def push(filter: MedianWindow, point: Point) -> MedianWindow:
    """Return the filter with one more sample, which waits."""
    return MedianWindow((*filter.points, point), filter.waiting + 1)


def set_duration(filter: MedianWindow, duration_ns: int) -> MedianWindow:
    """Return the filter with the duration of its newest sample, which is known once the next sample is there."""
    t_ns, x, y, _ = filter.points[-1]
    return MedianWindow((*filter.points[:-1], (t_ns, x, y, duration_ns)), filter.waiting)


def pop_ready(filter: MedianWindow, now_ns: int, half_ns: int) -> tuple[MedianWindow, list[Point]]:
    """Return the rest of the filter, and the filtered samples that no sample from ``now_ns`` on can change."""
    points, waiting, ready = filter.points, filter.waiting, []
    while waiting and (points[-waiting][0] + half_ns < now_ns or len(points) > LONGEST_WINDOW):
        ready.append(_filtered(points, len(points) - waiting, half_ns))
        waiting -= 1
        points = _within_reach(points, waiting, now_ns - half_ns, half_ns)
    return (MedianWindow(points, waiting), ready) if ready else (filter, ready)


def flush(filter: MedianWindow, half_ns: int) -> list[Point]:
    """Return all samples that still wait, filtered, when no sample follows."""
    points = filter.points
    return [_filtered(points, i, half_ns) for i in range(len(points) - filter.waiting, len(points))]


def _filtered(points: tuple[Point, ...], i: int, half_ns: int) -> Point:
    t_ns, _, _, duration_ns = points[i]
    first, end = 0, len(points)
    while points[first][0] < t_ns - half_ns:
        first += 1
    while points[end - 1][0] > t_ns + half_ns:
        end -= 1
    around = points[first:end]
    return t_ns, _median([p[1] for p in around]), _median([p[2] for p in around]), duration_ns


def _median(values: list[float]) -> float:
    values.sort()
    middle = len(values) // 2
    return values[middle] if len(values) % 2 else (values[middle - 1] + values[middle]) / 2


def _within_reach(points: tuple[Point, ...], waiting: int, since_ns: int, half_ns: int) -> tuple[Point, ...]:
    """Return the points without those that are too old for the next filtered sample and for all that follow it."""
    if waiting:
        since_ns = min(since_ns, points[-waiting][0] - half_ns)
    first = 0
    while first < len(points) - waiting and points[first][0] < since_ns:
        first += 1
    return points[first:][-LONGEST_WINDOW:]
