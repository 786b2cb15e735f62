"""The AOI of each exported sample is that of a program that looks at one sample after the other."""

from __future__ import annotations

import random
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shift_recording.export.hits import HitFinder
from shift_schemas.messages import Aois, PlacedAoi
from shift_schemas.timestamps import Stamp
from shift_study.area_geometry import NOWHERE, Area, area_at, area_of
from shift_study.loading import given_study

STUDY = given_study({
    "study": "hits",
    "aois": [
        {"name": "cup", "rectangle": [0.3, 0.3, 0.6, 0.7]},
        {"name": "robot", "polygon": [[0.0, 0.0], [0.5, 0.0], [0.2, 1.0], [0.1, 0.4]]},
        {"name": "table", "rectangle": [0.0, 0.5, 1.0, 1.0]},
    ],
})  # fmt: skip
STILL = tuple(map(area_of, STUDY.aois))


def moved(seq: int, t: float, *aois: PlacedAoi, source: str = "tx", outcome: Any = "applied") -> Aois:
    return Aois(
        session="s1", stamp=Stamp.of(0), source=source, seq=seq, t=t, aois=list(aois), outcome=outcome
    )  # fmt: skip


def names(finder: HitFinder, chunks: list[tuple[str, int, list[float]]], x: Any, y: Any, seen: Any) -> list[str | None]:
    t = np.array([t for _, _, times in chunks for t in times])
    counts = [len(times) for _, _, times in chunks]
    found = finder.hits([c[0] for c in chunks], [c[1] for c in chunks], counts, t, np.array(x), np.array(y), seen)
    return [finder.names[i] for i in found]


def naive(areas: tuple[Area, ...], x: float, y: float) -> str | None:
    found = area_at(areas, x, y)
    return None if found == NOWHERE else STUDY.aoi_names[found]


@settings(deadline=None)
@given(seed=st.integers(0, 10**6))
def test_still_areas_give_the_first_one_at_the_point(seed: int) -> None:
    rng = random.Random(seed)
    edges = [0.0, 0.2, 0.3, 0.5, 0.6, 0.7, 1.0]
    points = [
        [rng.choice([rng.uniform(-0.5, 1.5), rng.choice(edges)]) for _ in range(2)] for _ in range(200)
    ]  # fmt: skip
    seen = np.array([rng.random() > 0.1 for _ in points])
    found = names(HitFinder(STUDY), [("tx", 0, [i / 100 for i in range(200)])], *zip(*points, strict=True), seen)
    assert found == [naive(STILL, x, y) if ok else None for (x, y), ok in zip(points, seen, strict=True)]


@settings(deadline=None)
@given(seed=st.integers(0, 10**6))
def test_moving_areas_give_the_one_that_held_at_the_time_of_each_sample(seed: int) -> None:
    rng = random.Random(seed)
    finder, layouts = HitFinder(STUDY), [(-1.0, STILL)]
    for seq in range(40):
        left = rng.uniform(-0.5, 0.9)
        visible = rng.random() < 0.8
        box = [left, 0.1, left + 0.4, 0.9]
        finder.move(moved(seq, seq / 30, PlacedAoi(name="cup", visible=visible, rectangle=box)))
        layouts.append((seq / 30, (Area(*box) if visible else Area(0, 0, 0, 0), *STILL[1:])))
    times = sorted(rng.uniform(0, 1.5) for _ in range(120))
    points = [[rng.uniform(-0.2, 1.2), rng.uniform(-0.2, 1.2)] for _ in times]
    chunks = [("tx", 0, times[:50]), ("tx", 0, times[50:])]
    found = names(finder, chunks, *zip(*points, strict=True), np.ones(len(times), bool))
    held = [[areas for since, areas in layouts if since <= t][-1] for t in times]
    assert found == [naive(areas, x, y) for areas, (x, y) in zip(held, points, strict=True)]


def test_clock_that_goes_back_begins_with_the_newest_place() -> None:
    finder = HitFinder(STUDY)
    finder.move(moved(0, 100.0, PlacedAoi(name="cup", visible=True, rectangle=[0.8, 0.0, 0.9, 0.4])))
    late = moved(1, 50.0, PlacedAoi(name="cup", visible=False), outcome="late")
    finder.move(late)
    seen = np.ones(1, bool)
    assert names(finder, [("tx", 0, [100.1])], [0.85], [0.2], seen) == ["cup"]
    assert names(finder, [("tx", 1, [5.0])], [0.85], [0.2], seen) == ["cup"]
    assert not finder.begins_anew(moved(2, 5.1))
    finder.move(moved(2, 5.1, PlacedAoi(name="cup", visible=False)))
    assert names(finder, [("tx", 1, [5.05]), ("tx", 1, [5.15])], [0.85] * 2, [0.2] * 2, np.ones(2, bool)) == [
        "cup",
        None,
    ]
    assert finder.begins_anew(moved(3, 2.0))


def test_areas_of_another_source_do_not_move_for_this_one() -> None:
    finder = HitFinder(STUDY)
    finder.move(moved(0, 0.0, PlacedAoi(name="cup", visible=False), source="spare"))
    chunks = [("tx", 0, [1.0]), ("spare", 0, [1.0])]
    assert names(finder, chunks, [0.45, 0.45], [0.4, 0.4], np.ones(2, bool)) == ["cup", None]


@pytest.mark.parametrize("name", ["cup", "robot", "table"])
def test_names_follow_the_study(name: str) -> None:
    assert name in HitFinder(STUDY).names
