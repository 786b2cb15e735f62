"""Online fixation detection: a median filter, then I-DT (Salvucci & Goldberg 2000, ETRA, 71-78). Pure.

The detector reads one sample after another; times are integer nanoseconds on the source's clock. A sample stands for
the time until the next one, at most ``maximum_gap_s``. Time that no valid sample stands for is a gap; a gap longer
than ``maximum_gap_s`` ends a fixation. An open fixation keeps running sums instead of its samples.
"""

from __future__ import annotations

from math import atan, degrees
from typing import NamedTuple

from shift_schemas.timestamps import NS
from shift_study.constants import FixationSettings

from shift_monitor.median import EMPTY, MedianWindow, Point, flush, pop_ready, push, set_duration

LONGEST_CANDIDATE = 1024
"""Chosen: the most samples that wait to become a fixation, 0.06 s at 17 kHz; beyond, the oldest are dropped."""


class FixationRule(NamedTuple):
    """The study's fixation settings in the units of this module."""

    dispersion_deg: float
    minimum_ns: int
    half_filter_ns: int
    gap_ns: int
    width: float
    """Screen width, as a multiple of the distance from the eye."""
    height: float
    """Screen height, as a multiple of the distance from the eye."""


class OpenFixation(NamedTuple):
    """A fixation that has not ended."""

    start_ns: int
    end_ns: int
    samples: int
    sum_x: float
    sum_y: float
    left: float
    right: float
    top: float
    bottom: float


class Detector(NamedTuple):
    """The state of fixation detection between two samples."""

    last_ns: int | None = None
    """The time of the last sample, valid or not."""
    covered_ns: int | None = None
    """The end of the time that the last valid sample stands for.

    None if that sample is the newest one or if there was no valid sample.
    """
    filter: MedianWindow = EMPTY
    candidate: tuple[Point, ...] = ()
    """Filtered samples that may become a fixation."""
    open: OpenFixation | None = None


class EndedFixation(NamedTuple):
    """A fixation that has ended: start and end on the source's clock, mean position (0..1)."""

    start_ns: int
    end_ns: int
    x: float
    y: float


class FixationUpdate(NamedTuple):
    """The result of one sample: the samples inside a fixation, in order, and the fixations that ended."""

    dwells: list[Point]
    found: list[EndedFixation]


def rule_of(settings: FixationSettings) -> FixationRule:
    """Return the settings in the units of this module."""
    return FixationRule(
        settings.dispersion_deg,
        round(settings.minimum_duration_s * NS),
        round(settings.median_filter_s / 2 * NS),
        round(settings.maximum_gap_s * NS),
        settings.screen_width_cm / settings.distance_cm,
        settings.screen_height_cm / settings.distance_cm,
    )


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


def finish(detector: Detector, rule: FixationRule) -> FixationUpdate:
    """Return the remaining result when no sample follows.

    An open fixation ends. The last sample has no dwell.
    """
    output = FixationUpdate([], [])
    _finish(detector.filter, detector.candidate, detector.open, rule, output)
    return output


def dispersion_deg(left: float, right: float, top: float, bottom: float, rule: FixationRule) -> float:
    """Return x range + y range in degrees of visual angle (Salvucci & Goldberg's dispersion).

    A point's angle on an axis is ``atan((p - 0.5) * size / distance)``: the eye is straight before the middle of the
    screen.
    """
    horizontal = atan((right - 0.5) * rule.width) - atan((left - 0.5) * rule.width)
    vertical = atan((bottom - 0.5) * rule.height) - atan((top - 0.5) * rule.height)
    return degrees(horizontal + vertical)


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
