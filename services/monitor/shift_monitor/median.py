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
