"""One chunk of gaze: what is recorded of it, its number, its source and its clock."""

from __future__ import annotations

from dataclasses import replace

import pytest
from shift_monitor.core import dump, gaze_chunk_of, load, step
from shift_monitor.gaze_input import gaze_input
from shift_schemas.errors import Conflict, MalformedMessage
from shift_schemas.messages import (
    Gaze,
    GazeChunk,
    Observation,
)
from support.monitor_sessions import (
    NOW,
    Recorded,
    configured_session,
    fixations,
    fold,
    last,
    names,
    points,
    session,
    study,
)

# --- the record ---


def test_gaze_is_recorded_as_it_was_applied() -> None:
    chunk = GazeChunk(
        source="a", seq=0, t=[0.0, 0.1, 0.2], x=[0.1, None, 0.3], y=[0.2, 0.9, 0.4], valid=[True, False, False]
    )
    state, facts = fold(configured_session(), chunk)
    gaze = facts[0]
    assert isinstance(gaze, Gaze)
    assert (gaze.x, gaze.y, gaze.valid) == ([0.1, 0.0, 0.0], [0.2, 0.0, 0.0], [True, False, False])
    assert gaze.aoi == []
    assert fold(configured_session(), gaze_chunk_of(gaze)) == (state, facts)


def test_gaze_on_no_aoi_is_recorded_as_an_empty_name() -> None:
    state, facts = fold(configured_session(), names(0, [0.0, 0.1], ["left", None]))
    gaze = facts[0]
    assert isinstance(gaze, Gaze)
    assert (gaze.aoi, gaze.x, gaze.valid) == (["left", ""], [], [])
    assert fold(configured_session(), gaze_chunk_of(gaze)) == (state, facts)


def test_sample_without_valid_is_valid_where_x_and_y_are_given() -> None:
    _, facts = fold(configured_session(), GazeChunk(source="a", seq=0, t=[0.0, 0.1], x=[0.1, 0.2], y=[0.2, None]))
    assert isinstance(facts[0], Gaze)
    assert facts[0].valid == [True, False]


def test_gaze_is_uncertain_before_the_first_valid_sample_on_an_aoi() -> None:
    one = study(aois=[{"name": "cup", "rectangle": [0.0, 0.0, 0.5, 1.0]}])
    state, facts = fold(configured_session(one), points(0, [0.0, 0.01], [None, 0.9]))
    assert last(facts).gaze.category == "uncertain"
    _, facts = fold(state, points(1, [0.02], [0.2]))
    assert last(facts).gaze.category == "uncertain"  # no dwell yet
    _, facts = fold(state, points(1, [0.02 + i / 100 for i in range(60)], [0.2] * 60))
    assert last(facts).gaze.category == "focused"


# --- numbers, sources, clocks ---


def test_repeated_chunk_gets_the_same_reply_and_is_ignored() -> None:
    chunk = names(0, [0.0, 0.1], ["left", "left"])
    recorded = Recorded()
    state, facts = fold(configured_session(), chunk, names(1, [0.2], ["right"]), recorded=recorded)
    again = step(state, gaze_input(chunk, recorded), NOW)
    assert (again.facts, again.repeat) == ((), True)
    assert replace(again.state, ledgers=state.ledgers) == state
    assert again.state.ledgers[chunk.source].repeated == state.ledgers[chunk.source].repeated + 1
    assert again.result == {"accepted": 2, "source": "ros", "seq": 0, "observation": last(facts).version}


def test_missing_chunks_are_counted() -> None:
    state, facts = fold(configured_session(), names(2, [0.0], ["left"]))
    assert last(facts).gaze.dropped == 2
    _, facts = fold(state, names(6, [0.1], ["left"]))
    assert last(facts).gaze.dropped == 5
    assert last(facts).seen.gaze == {"ros": 6}


def test_late_chunk_is_recorded_and_not_applied_and_its_repeat_is_ignored() -> None:
    recorded = Recorded()
    state, before = fold(configured_session(), names(0, [0.0], ["left"]), names(3, [0.3], ["left"]), recorded=recorded)
    done = step(state, names(1, [0.1], ["right"]), NOW)
    recorded.gaze += [f for f in done.facts if isinstance(f, Gaze)]
    gaze, observation = done.facts
    assert isinstance(gaze, Gaze)
    assert isinstance(observation, Observation)
    assert gaze.outcome == "late"
    assert observation.gaze == last(before).gaze
    assert observation.seen.gaze == {"ros": 3}
    assert done.result == {
        "accepted": 0, "source": "ros", "seq": 1, "observation": 4,
        "warnings": ["chunk 1 comes after chunk 3: it is recorded and not applied"],
    }  # fmt: skip
    assert observation.warnings == gaze.warnings == done.result["warnings"]
    assert step(done.state, gaze_input(names(1, [0.1], ["right"]), recorded), NOW).facts == ()
    assert len(step(done.state, names(2, [0.2], ["right"]), NOW).facts) == 2


def test_late_chunk_is_recorded_in_each_of_two_hundred_gaps() -> None:
    recorded = Recorded()
    read = [names(2 * n + 1, [float(n)], ["left"]) for n in range(200)]
    state, _ = fold(configured_session(), *read, recorded=recorded)
    late = [names(2 * n, [n - 0.5], ["right"]) for n in range(200)]
    after, facts = fold(state, *late, recorded=recorded)
    outcomes = [f.outcome for f in facts if isinstance(f, Gaze)]
    assert outcomes == ["late"] * 200
    assert (after.dropped, after.restarts) == (200, 0)
    assert after.attention == state.attention


def test_new_source_replaces_the_former_one() -> None:
    t = [i / 100 for i in range(50)]
    state, _ = fold(configured_session(), points(4, [100 + s for s in t], [0.2] * 50, source="old"))
    state, facts = fold(state, names(0, [0.0], ["right"], source="new"))
    assert [type(f).__name__ for f in facts] == ["Gaze", "Fixation", "Observation"]
    assert [f.source for f in fixations(facts)] == ["old"]
    assert last(facts).seen.gaze == {"old": 4, "new": 0}
    with pytest.raises(Conflict, match="replaced by new"):
        step(state, points(5, [101.0], [0.2], source="old"), NOW)


def test_source_can_change_from_points_to_names() -> None:
    state, _ = fold(configured_session(), points(0, [i / 100 for i in range(50)], [0.2] * 50, source="a"))
    state, facts = fold(state, names(1, [0.5, 0.7], ["right", "right"], source="a"))
    assert len(fixations(facts)) == 1
    assert last(facts).gaze.aoi == "right"
    _, facts = fold(state, points(2, [0.8], [0.2], source="a"))
    assert last(facts).gaze.dropped == 0


def test_time_that_does_not_rise_is_refused() -> None:
    state, _ = fold(configured_session(), names(0, [0.0, 0.5], ["left", "left"]))
    with pytest.raises(MalformedMessage) as refused:
        step(state, names(1, [0.5], ["left"]), NOW)
    assert refused.value.errors[0].field == "t"
    assert step(state, names(1, [0.4], ["left"]), NOW).state.restarts == 1  # a clock that goes back is a restart
    with pytest.raises(MalformedMessage):
        step(state, names(1, [0.6, 0.6 + 1e-11], ["left", "left"]), NOW)


def test_unknown_aoi_is_refused_and_the_known_ones_are_listed() -> None:
    with pytest.raises(MalformedMessage) as refused:
        step(configured_session(), names(0, [0.0, 0.1], ["left", "cup"]), NOW)
    (error,) = refused.value.errors
    assert (error.field, error.value) == ("aoi.1", "cup")
    assert "left, middle, right" in error.rule


def test_point_beside_the_stimulus_is_accepted_and_an_impossible_one_is_refused() -> None:
    _, facts = fold(configured_session(), points(0, [0.0], [1.2]))
    assert last(facts).gaze.category == "uncertain"
    with pytest.raises(MalformedMessage):
        step(configured_session(), points(0, [0.0], [1e300]), NOW)


def test_largest_times_and_numbers_of_a_chunk_are_accepted() -> None:
    state, _ = fold(configured_session(), names(0, [-1e11], ["left"]), names(2**53, [1e11], ["right"]))
    state, facts = fold(state, points(2**53, [i / 100 - 1e9 for i in range(30)], [0.5] * 30), session("ending"))
    assert last(facts).gaze.dropped == 2**53
    assert load(dump(state)) == state
