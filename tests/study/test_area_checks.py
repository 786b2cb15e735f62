"""Areas of interest that no gaze can hit: refused or warned about, with the names."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shift_schemas.errors import InvalidStudy
from shift_study.area_checks import area_mistakes, area_warnings
from shift_study.area_geometry import area_at, area_of
from shift_study.areas import Aoi
from shift_study.constants import FixationSettings
from shift_study.loading import given_study, parse_study, patched, study_from_json, study_json, study_of
from shift_study.study import Study

Corners = list[list[float]]
BOW_TIE: Corners = [[0.2, 0.2], [0.8, 0.8], [0.8, 0.2], [0.2, 0.8]]
FLAT: Corners = [[0.2, 0.2], [0.5, 0.5], [0.8, 0.8]]
SLIVER: Corners = [[0.0, 0.0], [1.0, 1.0], [1.0, 0.99999]]
FRAME: Corners = [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0], [0.2, 0.2], [0.2, 0.8], [0.8, 0.8], [0.8, 0.2], [0.2, 0.2]]
"""The stimulus without its middle, drawn in one line: along its slit it touches itself and does not cross."""
SCREEN = FixationSettings()


def box(name: str, left: float, top: float, right: float, bottom: float) -> Aoi:
    """A rectangle."""
    return Aoi(name=name, rectangle=[left, top, right, bottom])


def shape(name: str, corners: Corners) -> Aoi:
    """A polygon."""
    return Aoi(name=name, polygon=corners)


def rules(*aois: Aoi) -> list[str]:
    """What is refused of these areas."""
    return [error.rule for error in area_mistakes(aois)]


# --- shapes ---


def test_a_crossed_outline_is_refused_with_the_edges_that_cross() -> None:
    (rule,) = rules(box("rest", 0, 0, 1, 1), shape("cup", BOW_TIE))
    assert "cup crosses itself: the edge [0.2, 0.2] to [0.8, 0.8] crosses the edge [0.8, 0.2] to [0.2, 0.8]" in rule
    assert rule.endswith("; list the corners in their order around it")


@pytest.mark.parametrize(
    "corners", [FLAT, [[0, 0], [1, 0], [0.5, 0]], [[0.5, 0.5]] * 3, [[0, 0], [1, 1], [0, 0], [1, 1]]]
)
def test_a_flat_outline_is_refused(corners: Corners) -> None:
    assert rules(shape("cup", corners))[0].startswith(
        "cup is flat: its corners lie on one line, so no gaze falls on it"
    )


@pytest.mark.parametrize(
    ("aoi", "says"),
    [(box("cup", 0.5, 0, 0.5000001, 1), "cup is 1e-07 of the stimulus wide, so no gaze falls on it"),
     (box("cup", 0, 0.5, 1, 0.50005), "cup is 5e-05 of the stimulus high"),
     (shape("cup", SLIVER), "cup is about 3.5e-06 of the stimulus thick"), (box("cup", 0.5, 0, 0.5002, 1), "")],
)  # fmt: skip
def test_an_area_too_thin_to_be_hit_is_refused(aoi: Aoi, says: str) -> None:
    assert (rules(aoi) or [""])[0].startswith(says)
    assert bool(rules(aoi)) == bool(says)


@pytest.mark.parametrize(
    "corners",
    [[[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]], FRAME, [[0, 0], [0, 0], [1, 0], [1, 1]],
     [[0, 0], [0.5, 0.5], [1, 0], [1, 1], [0.5, 0.5], [0, 1]], [[0, 0], [1, 0], [1, 1], [0.5, 0.2], [0, 1]]],
    ids=["closed", "with a hole", "a corner twice", "touching in a corner", "not convex"],
)  # fmt: skip
def test_an_outline_that_only_touches_itself_is_taken(corners: Corners) -> None:
    assert rules(shape("cup", corners)) == []


@given(st.lists(st.lists(st.integers(0, 4).map(lambda n: n / 4), min_size=2, max_size=2), min_size=3, max_size=7))
def test_an_outline_of_which_no_point_is_hit_is_refused(corners: Corners) -> None:
    areas = [area_of(shape("cup", corners))]
    hit = any(area_at(areas, (i + 0.5) / 64, (j + 0.25) / 64) == 0 for i in range(64) for j in range(64))
    assert hit or rules(shape("cup", corners))


def test_a_new_study_is_refused_and_one_that_is_recorded_is_read() -> None:
    given_: dict[str, Any] = {
        "study": "x",
        "aois": [{"name": "a", "rectangle": [0, 0, 1, 1]}, {"name": "b", "polygon": FLAT}],
    }
    with pytest.raises(InvalidStudy, match=r"study: aois.1.polygon: b is flat") as refused:
        given_study(given_)
    assert [(e.field, e.value) for e in refused.value.errors] == [("aois.1.polygon", "b")]
    recorded = study_of(given_)
    assert study_from_json(study_json(recorded)) == recorded
    assert patched(recorded, {"reward": {"decay": 0.2}}).aois == recorded.aois


def test_every_such_area_is_said_with_its_line() -> None:
    text = f"study: x\naois:\n- {{name: a, polygon: {FLAT}}}\n- name: b\n  polygon: {BOW_TIE}\n"
    with pytest.raises(InvalidStudy) as refused:
        parse_study(text, "mine.yaml")
    first, second = refused.value.sentences
    assert first.startswith("mine.yaml:3: aois.0.polygon: a is flat")
    assert second.startswith("mine.yaml:5: aois.1.polygon: b crosses itself")


# --- covered areas ---


def covered(*aois: Aoi) -> tuple[str, ...]:
    """What is warned about."""
    return area_warnings(aois, SCREEN)


def test_an_area_wholly_under_an_earlier_one_is_warned_about_with_both_names() -> None:
    (sentence,) = covered(box("screen", 0, 0, 1, 1), box("cup", 0.6, 0.4, 0.9, 0.9))
    assert sentence.startswith(
        "AOI cup lies wholly under screen: no gaze point falls on it, since the first area counts"
    )
    assert sentence.endswith("; list cup before screen")
    assert covered(box("cup", 0.6, 0.4, 0.9, 0.9), box("screen", 0, 0, 1, 1)) == ()


def test_an_area_wholly_under_several_together_is_found() -> None:
    left, right = box("left", 0, 0, 0.6, 1), shape("right", [[0.5, 0], [1, 0], [1, 1], [0.5, 1]])
    assert covered(left, right, box("cup", 0.3, 0.3, 0.8, 0.5))[0].startswith("AOI cup lies wholly under left, right:")
    assert covered(left, box("far", 0, 0.9, 1, 1), box("cup", 0.3, 0.3, 0.8, 0.5)) == ()


def test_a_hole_is_no_cover() -> None:
    assert covered(shape("frame", FRAME), box("cup", 0.3, 0.3, 0.7, 0.7)) == ()
    assert covered(shape("frame", FRAME), box("cup", 0, 0, 0.15, 0.15))[0].startswith("AOI cup lies wholly under frame")


@pytest.mark.parametrize(("right", "warned"), [(0.945, True), (0.955, True), (0.85, False), (0.5, False)])
def test_an_area_that_is_covered_for_the_most_part_is_warned_about(right: float, warned: bool) -> None:
    found = covered(box("screen", 0, 0, right, 1), box("cup", 0, 0, 1, 1))
    assert bool(found) == warned
    if found:
        assert f"AOI cup lies under screen with {right:.0%} of its area" in found[0]
        assert "list cup before screen if its gaze is to count" in found[0]


def test_neighbours_and_equal_halves_are_no_cover() -> None:
    assert covered(*Study(study="x").aois) == ()
    assert covered(box("a", 0, 0, 0.5, 1), box("b", 0.5, 0, 1, 1), shape("c", [[0, 0], [1, 0], [1, 1]])) != ()


span = st.integers(0, 6).flatmap(lambda low: st.tuples(st.just(low), st.integers(low + 1, 7)))


@given(st.lists(st.tuples(span, span), min_size=2, max_size=6))
def test_rectangles_are_covered_where_no_cell_of_them_is_first(
    spans: list[tuple[tuple[int, int], tuple[int, int]]],
) -> None:
    """Expected by looking at the middle of each cell of a grid of 7 x 7."""
    aois = [box(f"a{i}", x / 7, y / 7, x_end / 7, y_end / 7) for i, ((x, x_end), (y, y_end)) in enumerate(spans)]
    areas = [area_of(aoi) for aoi in aois]
    first = {area_at(areas, (x + 0.5) / 7, (y + 0.5) / 7) for x in range(7) for y in range(7)}
    found = {s.split()[1] for s in covered(*aois) if "wholly" in s}
    assert found == {aoi.name for i, aoi in enumerate(aois) if i not in first}


# --- narrow areas ---


def test_an_area_that_trackers_cannot_tell_is_warned_about_with_its_size() -> None:
    (sentence,) = covered(box("cup", 0, 0, 0.01, 1))
    assert sentence.startswith(
        "AOI cup is 0.51 cm wide on the screen, 0.45° at 65 cm; trackers are accurate to about 0.5°"
    )
    assert sentence.endswith("so gaze on an area below 1° is often missed; make it larger")
    assert area_warnings([box("cup", 0, 0, 0.01, 1)], FixationSettings(screen_width_cm=200)) == ()
