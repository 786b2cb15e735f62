"""Fixations on line: a median filter, then I-DT (Salvucci & Goldberg 2000, ETRA, 71-78). Pure.

Sample by sample, in integer nanoseconds of the source's clock. A sample stands for the time until the
next one, at most ``maximum_gap_s``. Time for which no valid sample stands is a gap; a longer one than
``maximum_gap_s`` ends a fixation. An open fixation keeps running sums, not its samples.
"""

from __future__ import annotations

from math import atan, degrees
from typing import NamedTuple

from shift_schemas.timestamps import NS
from shift_study.study import FixationSettings

from shift_monitor.median import EMPTY, Filter, Point, came_out, flushed, stood, taken

LONGEST_CANDIDATE = 1024
"""Chosen: samples that may wait to become a fixation, 0.06 s at 17 kHz; of more the oldest are given up."""


class Rule(NamedTuple):
    """The study's fixation settings in the units of this module."""

    dispersion_deg: float
    minimum_ns: int
    half_filter_ns: int
    gap_ns: int
    width: float
    """Screen width in distances from the eye."""
    height: float


class Open(NamedTuple):
    """A fixation that goes on."""

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
    """What the detector remembers from one sample to the next."""

    last_ns: int | None = None
    """Time of the last sample, valid or not."""
    covered_ns: int | None = None
    """Until when the last valid sample stands; none: it is the last one, or there was none."""
    filter: Filter = EMPTY
    candidate: tuple[Point, ...] = ()
    """Filtered samples that may yet become a fixation."""
    open: Open | None = None


class Found(NamedTuple):
    """A finished fixation: mean position 0..1, source clock."""

    start_ns: int
    end_ns: int
    x: float
    y: float


class Output(NamedTuple):
    """What follows from a sample: samples inside a fixation, in order, and fixations that ended."""

    dwells: list[Point]
    found: list[Found]


def rule_of(settings: FixationSettings) -> Rule:
    """The settings, converted once."""
    return Rule(
        settings.dispersion_deg,
        round(settings.minimum_duration_s * NS),
        round(settings.median_filter_s / 2 * NS),
        round(settings.maximum_gap_s * NS),
        settings.screen_width_cm / settings.distance_cm,
        settings.screen_height_cm / settings.distance_cm,
    )


def fed(detector: Detector, t_ns: int, point: tuple[float, float] | None, rule: Rule) -> tuple[Detector, Output]:
    """The detector after one more sample, later than all before; ``point`` is none where it was lost."""
    output = Output([], [])
    filter, covered_ns = detector.filter, detector.covered_ns
    if covered_ns is None and detector.last_ns is not None and filter.points:
        duration_ns = min(t_ns - detector.last_ns, rule.gap_ns)
        covered_ns = detector.last_ns + duration_ns
        filter = stood(filter, duration_ns)
    candidate, open_ = detector.candidate, detector.open
    if covered_ns is not None and t_ns - covered_ns > rule.gap_ns:
        _ended(filter, candidate, open_, rule, output)
        filter, candidate, open_ = EMPTY, (), None
    if point is not None:
        filter = taken(filter, (t_ns, *point, 0))
        covered_ns = None
    filter, ready = came_out(filter, t_ns, rule.half_filter_ns)
    for filtered in ready:
        candidate, open_ = _detected(candidate, open_, filtered, rule, output)
    return Detector(t_ns, covered_ns, filter, candidate, open_), output


def ended(detector: Detector, rule: Rule) -> Output:
    """What is still to come when no sample follows: an open fixation ends; the last sample has no dwell."""
    output = Output([], [])
    _ended(detector.filter, detector.candidate, detector.open, rule, output)
    return output


def dispersion_deg(left: float, right: float, top: float, bottom: float, rule: Rule) -> float:
    """X range + y range in degrees of visual angle (Salvucci & Goldberg's dispersion).

    A point's angle on an axis is ``atan((p - 0.5) * size / distance)``: an eye straight before the
    middle of the screen.
    """
    horizontal = atan((right - 0.5) * rule.width) - atan((left - 0.5) * rule.width)
    vertical = atan((bottom - 0.5) * rule.height) - atan((top - 0.5) * rule.height)
    return degrees(horizontal + vertical)


def _ended(filter: Filter, candidate: tuple[Point, ...], open_: Open | None, rule: Rule, output: Output) -> None:
    for filtered in flushed(filter, rule.half_filter_ns):
        candidate, open_ = _detected(candidate, open_, filtered, rule, output)
    if open_ is not None:
        output.found.append(_closed(open_))


def _detected(
    candidate: tuple[Point, ...], open_: Open | None, point: Point, rule: Rule, output: Output
) -> tuple[tuple[Point, ...], Open | None]:
    """One step of I-DT with a filtered sample."""
    if open_ is not None:
        longer = _extended(open_, point)
        if _is_small(longer, rule):
            output.dwells.append(point)
            return (), longer
        output.found.append(_closed(open_))
    return _sought((*candidate, point)[-LONGEST_CANDIDATE:], rule, output)


def _sought(candidate: tuple[Point, ...], rule: Rule, output: Output) -> tuple[tuple[Point, ...], Open | None]:
    """The window that covers the minimum duration: a fixation, or its first sample is given up.

    Chosen: at least two samples, for one alone says nothing about dispersion.
    """
    while len(candidate) > 1 and candidate[-1][0] + candidate[-1][3] - candidate[0][0] >= rule.minimum_ns:
        found = _opened(candidate)
        if _is_small(found, rule):
            output.dwells.extend(candidate)
            return (), found
        candidate = candidate[1:]
    return candidate, None


def _opened(points: tuple[Point, ...]) -> Open:
    xs, ys = [p[1] for p in points], [p[2] for p in points]
    end_ns = points[-1][0] + points[-1][3]
    return Open(
        points[0][0], end_ns, len(points), sum(xs), sum(ys), min(xs), max(xs), min(ys), max(ys)
    )  # fmt: skip


def _extended(o: Open, point: Point) -> Open:
    t_ns, x, y, duration_ns = point
    return Open(
        o.start_ns, t_ns + duration_ns, o.samples + 1, o.sum_x + x, o.sum_y + y,
        x if x < o.left else o.left, x if x > o.right else o.right,
        y if y < o.top else o.top, y if y > o.bottom else o.bottom,
    )  # fmt: skip


def _is_small(o: Open, rule: Rule) -> bool:
    return dispersion_deg(o.left, o.right, o.top, o.bottom, rule) <= rule.dispersion_deg


def _closed(o: Open) -> Found:
    return Found(o.start_ns, o.end_ns, o.sum_x / o.samples, o.sum_y / o.samples)
