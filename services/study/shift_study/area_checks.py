"""Checks of areas of interest that no gaze, or little gaze, can hit: flat, crossed, thin and covered ones. Pure.

Flat, crossed and thin shapes are mistakes. A covered area gives only a warning: gaze may come as AOI names, which need
no shape, and areas that move can leave the areas above them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import combinations
from typing import TYPE_CHECKING, Any

from shift_schemas.errors import FieldError

from shift_study.areas import Aoi
from shift_study.constants import FixationSettings

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

THINNEST = 1e-4
"""Share of the stimulus; less than a pixel of an 8K screen (1/7680). Chosen: nothing can be shown there."""
MOSTLY = 0.9
"""Share of an area under earlier ones from which it is warned about; chosen."""
WHOLLY = 1.0 - 1e-9
"""The share at which only the rounding of the coordinates is left of the area."""
NARROW_DEG = 1.0
"""Visual angle, degrees: trackers are accurate to about 0.5 degrees on either side (Holmqvist et al. 2011, ch. 6)."""

Corner = Sequence[float]


def area_mistakes(aois: Sequence[Aoi]) -> tuple[FieldError, ...]:
    """Return a field error for each area whose shape is flat, crosses itself, or is too thin to be hit."""
    found = []
    for i, aoi in enumerate(aois):
        shape = "rectangle" if aoi.rectangle is not None else "polygon"
        if rule := _rectangle_rule(aoi) if aoi.rectangle is not None else _polygon_rule(aoi):
            found.append(FieldError(field=f"aois.{i}.{shape}", value=aoi.name, rule=f"{aoi.name} {rule}"))
    return tuple(found)


def area_warnings(aois: Sequence[Aoi], screen: FixationSettings) -> tuple[str, ...]:
    """Return a sentence for each area that lies mostly under earlier ones, or is narrower than trackers can tell."""
    narrow = [sentence for aoi in aois if (sentence := _narrow(aoi, screen))]
    return (*_covered(aois), *narrow)


def _rectangle_rule(aoi: Aoi) -> str:
    left, top, right, bottom = aoi.rectangle or (0.0, 0.0, 1.0, 1.0)
    for size, side in ((right - left, "wide"), (bottom - top, "high")):
        if size < THINNEST:
            return _thin(f"is {size:.2g} of the stimulus {side}")
    return ""


def _thin(said: str) -> str:
    return f"{said}, so no gaze falls on it; make it at least {THINNEST:g}, or remove it"


def _polygon_rule(aoi: Aoi) -> str:
    corners = aoi.polygon or []
    outline = _outline(corners)
    if crossing := None if outline.is_valid else _crossing(corners):
        first, second = (f"{_corner_text(a)} to {_corner_text(b)}" for a, b in crossing)
        return f"crosses itself: the edge {first} crosses the edge {second}; list the corners in their order around it"
    width = 2 * _area(outline) / outline.length if outline.length else 0.0
    if width < 1e-12:
        return "is flat: its corners lie on one line, so no gaze falls on it; move a corner off the line"
    return _thin(f"is about {width:.2g} of the stimulus thick") if width < THINNEST else ""


def _corner_text(corner: Corner) -> str:
    return f"[{corner[0]:g}, {corner[1]:g}]"


def _crossing(corners: list[list[float]]) -> tuple[tuple[Corner, Corner], tuple[Corner, Corner]] | None:
    """Return the first two edges that cross inside both. Edges that only touch can belong to an area with a hole."""
    edges = list(zip(corners, corners[1:] + corners[:1], strict=True))
    for (a, b), (c, d) in combinations(edges, 2):
        if _turn(a, b, c) * _turn(a, b, d) < 0 and _turn(c, d, a) * _turn(c, d, b) < 0:
            return (a, b), (c, d)
    return None


def _turn(a: Corner, b: Corner, c: Corner) -> float:
    """Return a number above 0 if c lies on one side of the line from a to b, below 0 on the other, 0 on it."""
    found = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    return 0.0 if abs(found) < 1e-12 else found


# --- covered areas ---


def _covered(aois: Sequence[Aoi]) -> Iterator[str]:
    boxes = [_box(aoi) for aoi in aois]
    shapes: dict[int, BaseGeometry] = {}
    for i, aoi in enumerate(aois):
        above = [j for j in range(i) if _overlap(boxes[i], boxes[j])]
        if not above:
            continue
        for j in (i, *above):
            shapes.setdefault(j, _shape(aois[j]))
        share, covering = _share_under(shapes[i], [shapes[j] for j in above])
        names = ", ".join(aois[above[k]].name for k in covering)
        if share >= WHOLLY:
            yield (f"AOI {aoi.name} lies wholly under {names}: no gaze point falls on it, since the first area counts "
                   f"where two overlap; list {aoi.name} before {names}")  # fmt: skip
        elif share >= MOSTLY:
            yield (f"AOI {aoi.name} lies under {names} with {share:.0%} of its area, and the first area counts where "
                   f"two overlap; list {aoi.name} before {names} if its gaze is to count")  # fmt: skip


def _share_under(shape: BaseGeometry, above: list[BaseGeometry]) -> tuple[float, list[int]]:
    """Return the share of ``shape`` under the union of those above it, and which of them cover any of it."""
    from shapely import union_all

    parts = [shape.intersection(other) for other in above]
    area = _area(shape)
    if not area:
        return 0.0, []
    covering = [k for k, part in enumerate(parts) if _area(part) > 1e-9 * area]
    return _area(union_all(parts)) / area, covering


def _box(aoi: Aoi) -> tuple[float, float, float, float]:
    if aoi.rectangle is not None:
        left, top, right, bottom = aoi.rectangle
        return left, top, right, bottom
    xs, ys = zip(*(aoi.polygon or [[0.0, 0.0]]), strict=True)
    return min(xs), min(ys), max(xs), max(ys)


def _overlap(a: tuple[float, ...], b: tuple[float, ...]) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def _shape(aoi: Aoi) -> BaseGeometry:
    """Return the area as a valid geometry, by the even-odd rule if its outline touches itself."""
    from shapely import box, make_valid

    found: BaseGeometry = make_valid(_outline(aoi.polygon) if aoi.polygon else box(*_box(aoi)))
    return found


def _outline(corners: Sequence[Corner]) -> Any:
    from shapely import Polygon  # imported late: rectangles that do not overlap never need it

    return Polygon(corners)


def _area(shape: Any) -> float:
    from shapely import make_valid

    return float((shape if shape.is_valid else make_valid(shape)).area)


# --- narrow areas ---


def _narrow(aoi: Aoi, screen: FixationSettings) -> str:
    left, top, right, bottom = _box(aoi)
    sizes = {"wide": (right - left) * screen.screen_width_cm, "high": (bottom - top) * screen.screen_height_cm}
    side = min(sizes, key=lambda name: sizes[name])
    angle = 2 * math.degrees(math.atan(sizes[side] / 2 / screen.distance_cm))
    if angle >= NARROW_DEG:
        return ""
    size = f"{sizes[side]:.2g} cm {side} on the screen, {angle:.2g}° at {screen.distance_cm:g} cm"
    return (
        f"AOI {aoi.name} is {size}; trackers are accurate to about 0.5°, so gaze on an area below {NARROW_DEG:g}° is "
        "often missed; make it larger"
    )
