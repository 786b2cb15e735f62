"""The area of interest that a point falls on."""

from __future__ import annotations

import pytest
from shift_study.area_geometry import NOWHERE, area_at, area_of
from shift_study.areas import Aoi
from shift_study.study import Study

THIRDS = [area_of(a) for a in Study(study="default").aois]


@pytest.mark.parametrize(
    ("x", "index"), [(0.0, 0), (0.33, 0), (1 / 3, 1), (0.5, 1), (2 / 3, 2), (1.0, 2), (-0.01, -1), (1.01, -1)]
)
def test_neighbouring_areas_share_no_point_and_the_last_edge_belongs_to_the_stimulus(x: float, index: int) -> None:
    assert area_at(THIRDS, x, 0.5) == index
    assert area_at(THIRDS, x, 1.0) == index


def test_first_of_two_overlapping_areas_counts() -> None:
    small = Aoi(name="small", rectangle=[0.4, 0.4, 0.6, 0.6])
    all_of_it = Aoi(name="all", rectangle=[0.0, 0.0, 1.0, 1.0])
    assert area_at([area_of(small), area_of(all_of_it)], 0.5, 0.5) == 0
    assert area_at([area_of(all_of_it), area_of(small)], 0.5, 0.5) == 0
    assert area_at([area_of(small), area_of(all_of_it)], 0.7, 0.5) == 1


def test_middle_of_a_hollow_polygon_is_outside() -> None:
    frame = [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0.25], [0.75, 0.25], [0.75, 0.75], [0.0, 0.75]]
    area = [area_of(Aoi(name="frame", polygon=[[float(x), float(y)] for x, y in frame]))]
    assert area_at(area, 0.5, 0.1) == 0
    assert area_at(area, 0.9, 0.5) == 0
    assert area_at(area, 1.0, 0.5) == 0


def test_rectangle_written_as_a_polygon_is_the_same_area() -> None:
    left, top, right, bottom = 0.25, 0.3, 0.8, 1.0
    rectangle = [area_of(Aoi(name="a", rectangle=[left, top, right, bottom]))]
    corners = [[left, top], [right, top], [right, bottom], [left, bottom]]
    polygon = [area_of(Aoi(name="a", polygon=corners))]
    grid = [i / 40 for i in range(-4, 45)]
    for x in grid:
        for y in grid:
            assert area_at(polygon, x, y) == area_at(rectangle, x, y), (x, y)


def test_triangle_follows_the_even_odd_rule() -> None:
    triangle = [area_of(Aoi(name="t", polygon=[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]))]
    assert area_at(triangle, 0.2, 0.2) == 0
    assert area_at(triangle, 0.6, 0.6) == NOWHERE
