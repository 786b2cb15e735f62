"""A median filter over gaze samples, on line and in time, not in samples. Pure.

Each sample is replaced by the median, per coordinate, of the valid samples of its segment within half a
window before and after it. So it comes out half a window late, and no later sample can change it: what
comes out depends on the samples alone, not on how they are cut into chunks. (Median filtering keeps the
edges of saccades; Juhola 1985, Comput. Biol. Med. 15(2), 73-84.)
"""

from __future__ import annotations

from typing import NamedTuple

Point = tuple[int, float, float, int]
"""A gaze sample: t_ns on the source's clock, x and y 0..1, and for how long it stands, ns."""

LONGEST_WINDOW = 256
"""Chosen: samples that are kept at most, 30 ms at 8 kHz; a faster one comes out early instead."""


class Filter(NamedTuple):
    """The samples within reach, of which the last ``waiting`` have not come out yet."""

    points: tuple[Point, ...] = ()
    waiting: int = 0


EMPTY = Filter()


def taken(filter: Filter, point: Point) -> Filter:
    """The filter with one more sample, which waits."""
    return Filter((*filter.points, point), filter.waiting + 1)


def stood(filter: Filter, duration_ns: int) -> Filter:
    """The filter once it is known for how long its newest sample stands."""
    t_ns, x, y, _ = filter.points[-1]
    return Filter((*filter.points[:-1], (t_ns, x, y, duration_ns)), filter.waiting)


def came_out(filter: Filter, now_ns: int, half_ns: int) -> tuple[Filter, list[Point]]:
    """What no sample from ``now_ns`` on can change any more, filtered, and the filter without it."""
    points, waiting, out = filter.points, filter.waiting, []
    while waiting and (points[-waiting][0] + half_ns < now_ns or len(points) > LONGEST_WINDOW):
        out.append(_filtered(points, len(points) - waiting, half_ns))
        waiting -= 1
        points = _within_reach(points, waiting, now_ns - half_ns, half_ns)
    return (Filter(points, waiting), out) if out else (filter, out)


def flushed(filter: Filter, half_ns: int) -> list[Point]:
    """All that still waits, filtered: nothing will follow."""
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
    """Without what is too old for the next sample that comes out and for all that follow it."""
    if waiting:
        since_ns = min(since_ns, points[-waiting][0] - half_ns)
    first = 0
    while first < len(points) - waiting and points[first][0] < since_ns:
        first += 1
    return points[first:][-LONGEST_WINDOW:]
