"""An online median filter over gaze samples; its window is a time, not a number of samples. Pure.

Each sample is replaced by the median, for each coordinate, of the valid samples of its segment within half a
window before and after it. A filtered sample is ready half a window late, and no later sample can change it. So the
result depends on the samples alone, not on how they are cut into chunks. Median filtering keeps the edges of
saccades (Juhola 1985, Comput. Biol. Med. 15(2), 73-84).
"""

from __future__ import annotations

from typing import NamedTuple

Point = tuple[int, float, float, int]
"""A gaze sample: its time on the source's clock (ns), x and y (0..1), and the duration that it stands for (ns)."""

LONGEST_WINDOW = 256
"""Chosen: the most samples that are kept, 30 ms at 8 kHz; those of a faster source are ready early."""


class MedianWindow(NamedTuple):
    """The samples within reach; the last ``waiting`` of them are not filtered yet."""

    points: tuple[Point, ...] = ()
    waiting: int = 0


EMPTY = MedianWindow()


class MedianFilter:
    """The filter while one step runs. It changes in place; :attr:`window` is its state between two steps."""

    __slots__ = ("_half_ns", "_points", "_waiting")

    def __init__(self, window: MedianWindow, half_ns: int) -> None:
        self._points = list(window.points)
        self._waiting = window.waiting
        self._half_ns = half_ns

    @property
    def window(self) -> MedianWindow:
        """The samples within reach."""
        return MedianWindow(tuple(self._points), self._waiting)

    @property
    def empty(self) -> bool:
        """Whether no sample is within reach."""
        return not self._points

    def push(self, t_ns: int, x: float, y: float) -> None:
        """Add a sample, which waits. The duration that it stands for is known once the next sample is there."""
        self._points.append((t_ns, x, y, 0))
        self._waiting += 1

    def set_duration(self, duration_ns: int) -> None:
        """Set the duration that the newest sample stands for."""
        t_ns, x, y, _ = self._points[-1]
        self._points[-1] = (t_ns, x, y, duration_ns)

    def pop_ready(self, now_ns: int) -> list[Point]:
        """Return the filtered samples that no sample from ``now_ns`` on can change."""
        points, half_ns, waiting = self._points, self._half_ns, self._waiting
        ready = []
        while waiting and (points[-waiting][0] + half_ns < now_ns or len(points) > LONGEST_WINDOW):
            ready.append(_filtered(points, len(points) - waiting, half_ns))
            waiting -= 1
            _forget(points, waiting, now_ns - half_ns, half_ns)
        self._waiting = waiting
        return ready

    def flush(self) -> list[Point]:
        """Return all samples that still wait, filtered, when no sample follows; the filter is empty afterwards."""
        points = self._points
        ready = [_filtered(points, i, self._half_ns) for i in range(len(points) - self._waiting, len(points))]
        self._points, self._waiting = [], 0
        return ready


def _filtered(points: list[Point], i: int, half_ns: int) -> Point:
    t_ns, x, y, duration_ns = points[i]
    first, end = 0, len(points)
    since_ns, until_ns = t_ns - half_ns, t_ns + half_ns
    while points[first][0] < since_ns:
        first += 1
    while points[end - 1][0] > until_ns:
        end -= 1
    count = end - first
    if count == 1:
        return t_ns, x, y, duration_ns
    _, xs, ys, _ = zip(*points[first:end], strict=True)
    ordered_x, ordered_y, middle = sorted(xs), sorted(ys), count // 2
    if count % 2:
        return t_ns, ordered_x[middle], ordered_y[middle], duration_ns
    x = (ordered_x[middle - 1] + ordered_x[middle]) / 2
    y = (ordered_y[middle - 1] + ordered_y[middle]) / 2
    return t_ns, x, y, duration_ns


def _forget(points: list[Point], waiting: int, since_ns: int, half_ns: int) -> None:
    """Remove the samples that are too old for the next filtered sample and for all that follow it."""
    if waiting:
        since_ns = min(since_ns, points[-waiting][0] - half_ns)
    first, filtered = 0, len(points) - waiting
    while first < filtered and points[first][0] < since_ns:
        first += 1
    first = max(first, len(points) - LONGEST_WINDOW)
    if first:
        del points[:first]
