"""Areas of interest: the area that a point falls on. Pure.

Points are 0..1 from the upper left corner. Where areas overlap, the first one counts (docs/interface.md).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from shift_study.areas import Aoi

NOWHERE = -1
"""The index that stands for no AOI."""

_LAST = math.nextafter(1.0, 0.0)


class Area(NamedTuple):
    """An AOI's bounding box and, where it is a polygon, its corners."""

    left: float
    top: float
    right: float
    bottom: float
    corners: tuple[tuple[float, float], ...] = ()


def area_of(aoi: Aoi) -> Area:
    """Return the area that a study's AOI describes."""
    if aoi.rectangle is not None:
        left, top, right, bottom = aoi.rectangle
        return Area(left, top, right, bottom)
    corners = tuple((x, y) for x, y in aoi.polygon or ())
    xs, ys = zip(*corners, strict=True)
    return Area(min(xs), min(ys), max(xs), max(ys), corners)


def area_at(areas: Sequence[Area], x: float, y: float) -> int:
    """Return the index of the first area that the point falls on, else ``NOWHERE``.

    An area includes its left and top edge and not its right and bottom one, so that neighbours share no point. The
    last edge of the stimulus, 1.0, belongs to the areas along it.
    """
    if x == 1.0:
        x = _LAST
    if y == 1.0:
        y = _LAST
    for i, (left, top, right, bottom, corners) in enumerate(areas):
        if left <= x < right and top <= y < bottom and (not corners or _inside(corners, x, y)):
            return i
    return NOWHERE


def areas_at(areas: Sequence[Area], x: float, y: float) -> list[int]:
    """Return the indices of all areas that the point falls on; the first one is that of :func:`area_at`."""
    return [i for i, area in enumerate(areas) if area_at((area,), x, y) != NOWHERE]


def _inside(corners: tuple[tuple[float, float], ...], x: float, y: float) -> bool:
    """Apply the even-odd rule: a ray to the right from a point inside crosses the outline an odd number of times."""
    inside = False
    before_x, before_y = corners[-1]
    for corner_x, corner_y in corners:
        if (corner_y > y) != (before_y > y):
            crossing = corner_x + (y - corner_y) / (before_y - corner_y) * (before_x - corner_x)
            if x < crossing:
                inside = not inside
        before_x, before_y = corner_x, corner_y
    return inside
