"""Online fixation detection: a median filter, then I-DT (Salvucci & Goldberg 2000, ETRA, 71-78). Pure.

The detector reads one sample after another; times are integer nanoseconds on the source's clock. A sample stands for
the time until the next one, at most ``maximum_gap_s``. Time that no valid sample stands for is a gap; a gap longer
than ``maximum_gap_s`` ends a fixation. An open fixation keeps running sums instead of its samples.

A step reads all samples of a chunk. Inside it the filter and the search change in place, since a new value for each
sample costs more than the arithmetic; between two steps there are only the frozen values of this module.
"""

from __future__ import annotations

from collections.abc import Iterable
from math import atan, degrees
from typing import NamedTuple

from shift_schemas.timestamps import NS
from shift_study.constants import FixationSettings

from shift_monitor.median import EMPTY, MedianFilter, MedianWindow, Point

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
    """The result of some samples: those inside a fixation, in order, and the fixations that ended."""

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
    detector: Detector, samples: Iterable[tuple[int, tuple[float, float] | None]], rule: FixationRule
) -> tuple[Detector, FixationUpdate]:
    """Return the detector after further samples, and their result.

    Parameters
    ----------
    samples
        The time of each sample and its position on the stimulus (0..1), or None for a lost sample. The times rise, and
        are later than those of all samples before.
    """
    last_ns, covered_ns, gap_ns = detector.last_ns, detector.covered_ns, rule.gap_ns
    filter = MedianFilter(detector.filter, rule.half_filter_ns)
    search = _Search(detector, rule)
    for t_ns, point in samples:
        if covered_ns is None and last_ns is not None and not filter.empty:
            duration_ns = min(t_ns - last_ns, gap_ns)
            covered_ns = last_ns + duration_ns
            filter.set_duration(duration_ns)
        if covered_ns is not None and t_ns - covered_ns > gap_ns:
            search.end(filter.flush())
        if point is not None:
            filter.push(t_ns, *point)
            covered_ns = None
        for filtered in filter.pop_ready(t_ns):
            search.add(filtered)
        last_ns = t_ns
    return Detector(last_ns, covered_ns, filter.window, tuple(search.candidate), search.open), search.result


def finish(detector: Detector, rule: FixationRule) -> FixationUpdate:
    """Return the remaining result when no sample follows.

    An open fixation ends. The last sample has no dwell.
    """
    search = _Search(detector, rule)
    search.end(MedianFilter(detector.filter, rule.half_filter_ns).flush())
    return search.result


def dispersion_deg(left: float, right: float, top: float, bottom: float, rule: FixationRule) -> float:
    """Return x range + y range in degrees of visual angle (Salvucci & Goldberg's dispersion).

    A point's angle on an axis is ``atan((p - 0.5) * size / distance)``: the eye is straight before the middle of the
    screen.
    """
    horizontal = atan((right - 0.5) * rule.width) - atan((left - 0.5) * rule.width)
    vertical = atan((bottom - 0.5) * rule.height) - atan((top - 0.5) * rule.height)
    return degrees(horizontal + vertical)


class _Search:
    """I-DT over filtered samples while one step runs; it changes in place."""

    __slots__ = ("_checked", "_rule", "candidate", "open", "result")

    def __init__(self, detector: Detector, rule: FixationRule) -> None:
        self.candidate = list(detector.candidate)
        self.open = detector.open
        self.result = FixationUpdate([], [])
        self._rule = rule
        self._checked = False
        """Whether the open fixation is known to be small by this rule."""

    def add(self, point: Point) -> None:
        """Read one more filtered sample."""
        if (open_ := self.open) is not None:
            longer = _extend(open_, point)
            if (self._checked and longer[5:] == open_[5:]) or _is_small(*longer[5:], self._rule):
                self.open, self._checked = longer, True
                self.result.dwells.append(point)
                return
            self._close(open_)
        self.candidate.append(point)
        if len(self.candidate) > LONGEST_CANDIDATE:
            del self.candidate[0]
        self._look()

    def end(self, points: list[Point]) -> None:
        """Read the last samples before a gap or before the end; an open fixation ends."""
        for point in points:
            self.add(point)
        if self.open is not None:
            self._close(self.open)
        self.candidate = []

    def _close(self, open_: OpenFixation) -> None:
        self.result.found.append(
            EndedFixation(open_.start_ns, open_.end_ns, open_.sum_x / open_.samples, open_.sum_y / open_.samples)
        )
        self.open = None

    def _look(self) -> None:
        """Open a fixation where the window that covers the minimum duration is small; else drop its first sample.

        Chosen: a fixation has at least two samples, since a single one says nothing about dispersion.
        """
        points, rule = self.candidate, self._rule
        end_ns = points[-1][0] + points[-1][3]
        while len(points) > 1 and end_ns - points[0][0] >= rule.minimum_ns:
            _, xs, ys, _ = zip(*points, strict=True)
            bounds = min(xs), max(xs), min(ys), max(ys)
            if _is_small(*bounds, rule):
                self.open = OpenFixation(points[0][0], end_ns, len(points), sum(xs), sum(ys), *bounds)
                self._checked = True
                self.result.dwells.extend(points)
                self.candidate = []
                return
            del points[0]


def _extend(o: OpenFixation, point: Point) -> OpenFixation:
    start_ns, _, samples, sum_x, sum_y, left, right, top, bottom = o
    t_ns, x, y, duration_ns = point
    return OpenFixation(
        start_ns, t_ns + duration_ns, samples + 1, sum_x + x, sum_y + y,
        x if x < left else left, x if x > right else right, y if y < top else top, y if y > bottom else bottom,
    )  # fmt: skip


def _is_small(left: float, right: float, top: float, bottom: float, rule: FixationRule) -> bool:
    return dispersion_deg(left, right, top, bottom, rule) <= rule.dispersion_deg
