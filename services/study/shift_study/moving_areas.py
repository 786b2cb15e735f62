"""Areas of interest that move: where they were at each time of the gaze source's clock. Pure.

An :class:`AreaTrack` keeps the layouts that gaze can still be tested against: gaze waits for the median filter and for
the end of its fixation. A layout holds all areas of the study; an area that is not visible has no size.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from typing import NamedTuple

from shift_schemas.messages import AoiPosition, PlacedAoi

from shift_study.area_geometry import Area

HIDDEN = Area(0.0, 0.0, 0.0, 0.0)
"""An area that no point falls on."""
MOST_LAYOUTS = 1024
"""Chosen: the layouts that are kept, 17 s at 60 Hz; a longer fixation is tested against the oldest of them."""


class Layout(NamedTuple):
    """The areas from a time on."""

    since_ns: int
    areas: tuple[Area, ...]


class AreasOverTime(NamedTuple):
    """The areas by time: ``first`` before the first of the ``layouts``."""

    first: tuple[Area, ...]
    layouts: tuple[Layout, ...] = ()

    def at(self, t_ns: int) -> tuple[Area, ...]:
        """Return the areas that held at a time, ns."""
        if not self.layouts:
            return self.first
        i = bisect_right(self.layouts, t_ns, key=_since)
        return self.layouts[i - 1].areas if i else self.first


class AreaTrack(NamedTuple):
    """The areas that one gaze source moved."""

    areas: AreasOverTime
    shapes: tuple[Area, ...]
    """The last shape of each area, also of one that is not visible."""
    last_ns: int | None = None
    """The time of the last message; None where the clock began anew, and before the first message."""

    @property
    def newest(self) -> tuple[Area, ...]:
        """The areas of the last layout."""
        return self.areas.layouts[-1].areas if self.areas.layouts else self.areas.first


def track_of(areas: tuple[Area, ...]) -> AreaTrack:
    """Return the track of a source that has moved nothing: the areas of the study."""
    return AreaTrack(AreasOverTime(areas), areas)


def moved(track: AreaTrack, t_ns: int, places: Sequence[tuple[int, AoiPosition]]) -> AreaTrack:
    """Return the track after a message that holds from ``t_ns`` on; each position comes with its area's index."""
    areas, shapes = list(track.newest), list(track.shapes)
    for i, position in places:
        shapes[i] = _shape(position) or shapes[i]
        areas[i] = shapes[i] if position.visible else HIDDEN
    layouts = (*track.areas.layouts, Layout(t_ns, tuple(areas)))
    return track._replace(areas=_bounded(AreasOverTime(track.areas.first, layouts)), shapes=tuple(shapes), last_ns=t_ns)


def begun_again(track: AreaTrack) -> AreaTrack:
    """Return the track where the source's clock begins anew: the newest areas hold until they are moved."""
    return AreaTrack(AreasOverTime(track.newest), track.shapes)


def forgotten_before(track: AreaTrack, t_ns: int) -> AreaTrack:
    """Return the track without the layouts that ended before ``t_ns``: no later sample is tested against them."""
    layouts = track.areas.layouts
    held = bisect_right(layouts, t_ns, key=_since)
    if held == 0:
        return track
    return track._replace(areas=AreasOverTime(layouts[held - 1].areas, layouts[held:]))


def placed(position: AoiPosition) -> PlacedAoi:
    """Return a position as it is recorded."""
    corners = position.polygon or []
    return PlacedAoi(
        name=position.name, visible=position.visible, rectangle=position.rectangle or [],
        polygon_x=[x for x, _ in corners], polygon_y=[y for _, y in corners],
    )  # fmt: skip


def position_of(recorded: PlacedAoi) -> AoiPosition:
    """Return the position that was recorded."""
    corners = [[x, y] for x, y in zip(recorded.polygon_x, recorded.polygon_y, strict=True)]
    return AoiPosition(
        name=recorded.name, visible=recorded.visible, rectangle=recorded.rectangle or None, polygon=corners or None
    )


def _bounded(areas: AreasOverTime) -> AreasOverTime:
    layouts = areas.layouts
    if len(layouts) <= MOST_LAYOUTS:
        return areas
    return AreasOverTime(layouts[-MOST_LAYOUTS - 1].areas, layouts[-MOST_LAYOUTS:])


def _shape(position: AoiPosition) -> Area | None:
    if position.rectangle is not None:
        left, top, right, bottom = position.rectangle
        return Area(left, top, right, bottom)
    if position.polygon is None:
        return None
    corners = tuple((x, y) for x, y in position.polygon)
    xs, ys = zip(*corners, strict=True)
    return Area(min(xs), min(ys), max(xs), max(ys), corners)


def _since(layout: Layout) -> int:
    return layout.since_ns
