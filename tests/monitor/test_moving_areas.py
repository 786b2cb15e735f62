"""AOIs that move: gaze is tested against those that held at its time, whenever the messages arrive."""

from __future__ import annotations

import json
import random
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError
from shift_monitor import core
from shift_monitor.area_step import PositionsWithHistory, RecordedPositions, positions_of
from shift_monitor.core import MonitorState
from shift_schemas.errors import Conflict, MalformedMessage
from shift_schemas.messages import AoiPosition, AoiPositions, Aois, Fixation, GazeChunk
from shift_schemas.timestamps import NS, Stamp
from shift_study.area_geometry import Area
from shift_study.moving_areas import HIDDEN, MOST_LAYOUTS, AreasOverTime, Layout, forgotten_before, moved, track_of
from support.monitor_sessions import configured_session, session

NOW = Stamp.of(1_700_000_000 * NS)
LEFT, RIGHT = [0.0, 0.0, 0.2, 1.0], [0.6, 0.0, 0.8, 1.0]


def positions(seq: int, t: float, source: str = "tx", **places: Any) -> AoiPositions:
    """Return a message; each AOI has a rectangle, or False where it is not visible, or True where it is again."""
    aois = [
        {"name": name, "visible": place} if isinstance(place, bool) else {"name": name, "rectangle": place}
        for name, place in places.items()
    ]
    return AoiPositions.model_validate({"source": source, "seq": seq, "t": t, "aois": aois})


def gaze(seq: int, first: float, last: float, x: float, source: str = "tx", rate_hz: float = 100.0) -> GazeChunk:
    count = round((last - first) * rate_hz)
    return GazeChunk(
        source=source, seq=seq, t=[first + i / rate_hz for i in range(count)], x=[x] * count, y=[0.5] * count
    )


def run(*messages: object, state: MonitorState | None = None) -> tuple[MonitorState, list[Any]]:
    state, facts = state or configured_session(), []
    for message in messages:
        done = core.step(state, message, NOW)
        state = done.state
        facts += done.facts
    return state, facts


def fixations(*messages: object) -> list[tuple[str, list[str]]]:
    """Return the AOIs of each fixation of a session."""
    _, facts = run(*messages, session("ending"))
    return [(fact.aoi, fact.aois) for fact in facts if isinstance(fact, Fixation)]


def test_gaze_falls_on_the_area_where_it_was_then() -> None:
    followed = fixations(
        positions(0, 0.0, left=RIGHT, right=False), gaze(0, 0.0, 0.5, 0.7), positions(1, 0.5, left=LEFT),
        gaze(1, 0.5, 1.0, 0.1), gaze(2, 1.0, 1.5, 0.7),
    )  # fmt: skip
    assert followed == [("left", ["left"]), ("left", ["left"]), ("", [])]


def test_area_that_is_not_visible_is_not_hit_until_it_is_again() -> None:
    found = fixations(
        positions(0, 0.0, left=RIGHT, right=False), positions(1, 0.5, left=False), positions(2, 1.0, left=True),
        gaze(0, 0.0, 0.5, 0.7), gaze(1, 0.65, 1.0, 0.7), gaze(2, 1.15, 1.5, 0.7),
    )  # fmt: skip
    assert [aoi for aoi, _ in found] == ["left", "", "left"]


def test_fixation_lists_all_areas_and_the_first_one_counts() -> None:
    (both,) = fixations(positions(0, 0.0, left=[0.0, 0.0, 1.0, 1.0]), gaze(0, 0.0, 0.5, 0.8))
    assert both == ("left", ["left", "right"])


def test_areas_that_come_late_hold_for_gaze_that_was_not_tested_and_it_is_said() -> None:
    _, facts = run(positions(0, 0.0, left=RIGHT, right=False), gaze(0, 0.0, 0.5, 0.7), positions(1, 0.2, left=LEFT))
    (warning,) = facts[-1].warnings
    assert "these AOIs hold from 0.2 s on, and gaze before 0.48" in warning
    assert isinstance(facts[-1], Aois)


@pytest.mark.parametrize("again", [{"left": LEFT}, {"left": RIGHT}])
def test_same_number_is_a_repeat_only_with_the_same_content(again: dict[str, Any]) -> None:
    first = positions(0, 0.0, left=LEFT)
    state, (fact,) = run(first)
    history = (RecordedPositions(fact.segment, positions_of(fact), tuple(fact.warnings)),)
    done = core.step(state, PositionsWithHistory(positions(0, 0.0, **again), history), NOW)
    assert done.repeat == (again == {"left": LEFT})
    assert (done.state == state) == done.repeat
    if not done.repeat:
        (other,) = done.facts
        assert (other.segment, other.outcome) == (1, "applied")


def test_overtaken_message_is_recorded_and_not_applied() -> None:
    state, facts = run(positions(0, 0.0, left=LEFT), positions(2, 0.2, left=RIGHT), positions(1, 0.1, left=LEFT))
    assert [fact.outcome for fact in facts] == ["applied", "applied", "late"]
    assert state.tracks["tx"].track.newest[0] == Area(*RIGHT)
    assert "come after later ones" in facts[-1].warnings[0]


def test_clock_that_begins_again_keeps_the_newest_areas_for_its_first_gaze() -> None:
    state, facts = run(
        positions(0, 100.0, left=RIGHT, right=False), gaze(0, 100.0, 100.5, 0.7), gaze(1, 5.0, 5.5, 0.7),
        positions(1, 5.5, left=LEFT), gaze(2, 5.5, 6.0, 0.1), session("ending"),
    )  # fmt: skip
    found = [(f.segment, f.aoi) for f in facts if isinstance(f, Fixation)]
    assert found == [(0, "left"), (1, "left"), (1, "left")]
    assert state.tracks["tx"].clock_segment == 1


def test_areas_may_announce_that_the_clock_begins_again() -> None:
    state, facts = run(
        positions(0, 100.0, left=RIGHT, right=False), gaze(0, 100.0, 100.5, 0.7), positions(1, 5.0, left=LEFT),
        gaze(1, 5.0, 5.5, 0.1), session("ending"),
    )  # fmt: skip
    assert [(f.segment, f.aoi) for f in facts if isinstance(f, Fixation)][-1] == (1, "left")
    assert state.tracks["tx"].clock_segment == 1


def test_areas_of_another_source_have_no_effect_and_it_is_said() -> None:
    state, facts = run(gaze(0, 0.0, 0.5, 0.7), positions(0, 0.5, "spare", left=RIGHT), gaze(1, 0.5, 1.0, 0.7))
    said = next(fact for fact in facts if isinstance(fact, Aois)).warnings
    assert said == ["gaze comes from tx: the AOIs of spare have no effect until gaze comes from spare"]
    _, facts = run(gaze(0, 1.0, 1.5, 0.7, "spare"), session("ending"), state=state)
    assert [f.aoi for f in facts if isinstance(f, Fixation)][-1] == "left"


def test_gaze_that_comes_as_names_is_warned_about() -> None:
    named = GazeChunk(source="tx", seq=0, t=[0.0, 0.1], aoi=["left", "left"])
    _, facts = run(named, positions(0, 0.2, left=RIGHT))
    assert "sends AOI names" in facts[-1].warnings[0]


def test_areas_are_refused_with_a_reason() -> None:
    state, _ = run(gaze(0, 0.0, 0.2, 0.7), gaze(0, 0.0, 0.2, 0.7, "spare"))
    with pytest.raises(Conflict, match="gaze source tx was replaced by spare"):
        run(positions(0, 0.0, left=LEFT), state=state)
    with pytest.raises(MalformedMessage, match=r"aois.0.name: lefd: one of the study's AOIs: .*did you mean 'left'"):
        run(positions(0, 0.0, lefd=LEFT))
    ended, _ = run(session("ending"))
    with pytest.raises(Conflict, match="has ended"):
        run(positions(0, 0.0, left=LEFT), state=ended)


@pytest.mark.parametrize(
    ("aois", "rule"),
    [
        ([{"name": "cup"}], "give rectangle, polygon, or visible: false"),
        ([{"name": "cup", "rectangle": [0.5, 0, 0.2, 1]}], "left < right"),
        ([{"name": "cup", "rectangle": [0, 0, 1, 1], "polygon": [[0, 0], [1, 0], [1, 1]]}], "either rectangle or"),
        ([{"name": "cup", "rectangle": [0, 0, 640, 480]}], "less than or equal to 2"),
        ([{"name": "cup", "visible": False}, {"name": "cup", "visible": True}], "names cup twice"),
        ([], "at least 1"),
    ],
)
def test_nonsense_is_refused_with_its_rule(aois: list[Any], rule: str) -> None:
    with pytest.raises(ValidationError, match=rule):
        AoiPositions.model_validate_json(json.dumps({"source": "s", "seq": 0, "t": 0.0, "aois": aois}))


def test_state_with_moving_areas_is_restored_exactly_and_stays_small() -> None:
    messages: list[object] = []
    for n in range(300):
        place = [n / 600, 0.0, n / 600 + 0.2, 1.0]
        messages += [positions(n, n / 30, left=place), gaze(n, n / 30, (n + 1) / 30 - 1e-9, 0.5, rate_hz=300)]
    state, _ = run(*messages)
    assert core.load(core.dump(state)) == state
    assert len(state.tracks["tx"].track.areas.layouts) < 310
    state, _ = run(gaze(300, 10.2, 10.4, 0.1), state=state)
    assert len(state.tracks["tx"].track.areas.layouts) <= 1


# --- the track ---


@settings(deadline=None)
@given(
    times=st.lists(st.integers(0, 100), max_size=30), asked=st.integers(-5, 105), forget=st.integers(-5, 105),
    seed=st.integers(0, 10**6),
)  # fmt: skip
def test_track_gives_the_areas_of_a_naive_search(times: list[int], asked: int, forget: int, seed: int) -> None:
    rng = random.Random(seed)
    start = (Area(0.0, 0.0, 0.5, 1.0), Area(0.5, 0.0, 1.0, 1.0))
    track, naive = track_of(start), [(-(10**9), start)]
    for t in sorted(times):
        i, visible, left = rng.randrange(2), rng.random() < 0.7, rng.random()
        shape = [left, 0.0, left + 0.1, 1.0]
        track = moved(track, t, [(i, AoiPosition(name="a", rectangle=shape, visible=visible))])
        areas = list(naive[-1][1])
        areas[i] = Area(*shape) if visible else HIDDEN
        naive.append((t, tuple(areas)))
    held = [areas for since, areas in naive if since <= asked][-1]
    assert track.areas.at(asked) == held
    if asked >= forget:
        assert forgotten_before(track, forget).areas.at(asked) == held


def test_track_is_bounded() -> None:
    track = track_of((Area(0.0, 0.0, 1.0, 1.0),))
    for n in range(MOST_LAYOUTS + 10):
        track = moved(track, n, [(0, AoiPosition(name="a", rectangle=[0.0, 0.0, (n + 1) / 2000, 1.0]))])
    assert len(track.areas.layouts) == MOST_LAYOUTS
    assert track.areas.at(0) == (Area(0.0, 0.0, 10 / 2000, 1.0),)


def test_areas_without_layouts_are_the_first_ones() -> None:
    areas = (Area(0.0, 0.0, 1.0, 1.0),)
    assert AreasOverTime(areas).at(5) == areas
    assert AreasOverTime(areas, (Layout(6, ()),)).at(5) == areas
