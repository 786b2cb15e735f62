"""The AOI that each recorded sample fell on: its point is tested against the AOIs that held at its time.

The rule is that of :mod:`shift_study.area_geometry`, for many samples at once. Without AOIs that move, all samples of a
batch are tested together; with them, those of a chunk that have the same layout.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from shift_schemas.messages import Aois
from shift_schemas.timestamps import NS
from shift_study.area_geometry import NOWHERE, Area, area_of
from shift_study.moving_areas import AreaTrack, begun_again, moved, position_of, track_of
from shift_study.study import Study

NAMELESS = 0
"""The index of no AOI among :attr:`HitFinder.names`."""


class HitFinder:
    """Finds the AOIs of samples of one recording. Hand it the messages in the order of the recording."""

    def __init__(self, study: Study) -> None:
        self.names: tuple[str | None, ...] = (None, *study.aoi_names)
        """What the indices of :meth:`hits` stand for."""
        self._areas = tuple(map(area_of, study.aois))
        self._index = {name: i for i, name in enumerate(study.aoi_names)}
        self._tracks: dict[str, AreaTrack] = {}
        self._segments: dict[str, int] = {}

    def begins_anew(self, fact: Aois) -> bool:
        """Return whether the time of moving AOIs goes back: the gaze before it must be tested first."""
        track = self._tracks.get(fact.source)
        return track is not None and track.last_ns is not None and round(fact.t * NS) < track.last_ns

    def move(self, fact: Aois) -> None:
        """Take AOIs that moved."""
        if fact.outcome != "applied":
            return
        track = self._tracks.get(fact.source) or track_of(self._areas)
        if self.begins_anew(fact):
            track = begun_again(track)
        places = [(self._index[aoi.name], position_of(aoi)) for aoi in fact.aois if aoi.name in self._index]
        self._tracks[fact.source] = moved(track, round(fact.t * NS), places)

    def hits(
        self, sources: Sequence[str], segments: Sequence[int], counts: Any, t: Any, x: Any, y: Any, seen: Any
    ) -> Any:
        """Return for each sample the index of its AOI among :attr:`names`; 0 is none.

        Parameters
        ----------
        sources, segments, counts
            Of each chunk: its source, its segment and how many samples it has.
        t, x, y, seen
            Of each sample: its time (s), its point (0..1), and whether it has one.
        """
        if not self._tracks:
            return np.where(seen, _first_areas(self._areas, x, y) + 1, NAMELESS)
        found = np.zeros(len(t), np.int64)
        end = 0
        for source, segment, count in zip(sources, segments, counts, strict=True):
            part = slice(end, end := end + int(count))
            found[part] = self._hits_of_chunk(source, segment, t[part], x[part], y[part])
        return np.where(seen, found + 1, NAMELESS)

    def _hits_of_chunk(self, source: str, segment: int, t: Any, x: Any, y: Any) -> Any:
        track = self._tracks.get(source)
        if track is None:
            return _first_areas(self._areas, x, y)
        if self._segments.setdefault(source, segment) != segment:
            self._segments[source] = segment
            if track.last_ns is not None and round(float(t[0]) * NS) < track.last_ns:
                track = self._tracks[source] = begun_again(track)
        found = np.empty(len(t), np.int64)
        times = np.round(t * NS).astype(np.int64)
        since = np.array([layout.since_ns for layout in track.areas.layouts], np.int64)
        held = np.searchsorted(since, times, side="right")
        for i in np.unique(held):
            areas = track.areas.layouts[i - 1].areas if i else track.areas.first
            same = held == i
            found[same] = _first_areas(areas, x[same], y[same])
        return found


def _first_areas(areas: Sequence[Area], x: Any, y: Any) -> Any:
    """Return the index of the first area of each point, as :func:`shift_study.area_geometry.area_at` finds it."""
    last = np.nextafter(1.0, 0.0)
    x, y = np.where(x == 1.0, last, x), np.where(y == 1.0, last, y)
    found = np.full(len(x), NOWHERE, np.int64)
    for i in range(len(areas) - 1, -1, -1):
        left, top, right, bottom, corners = areas[i]
        inside = (left <= x) & (x < right) & (top <= y) & (y < bottom)
        if corners:
            inside &= _inside(corners, x, y)
        found[inside] = i
    return found


def _inside(corners: Sequence[tuple[float, float]], x: Any, y: Any) -> Any:
    inside = np.zeros(len(x), bool)
    before_x, before_y = corners[-1]
    for corner_x, corner_y in corners:
        if corner_y != before_y:
            crossing = corner_x + (y - corner_y) / (before_y - corner_y) * (before_x - corner_x)
            inside ^= ((corner_y > y) != (before_y > y)) & (x < crossing)
        before_x, before_y = corner_x, corner_y
    return inside
