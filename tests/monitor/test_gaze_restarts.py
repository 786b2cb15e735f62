"""Restarts of gaze: a tracker's program that starts again, a clock that is set, a single wrong sample."""

from __future__ import annotations

from dataclasses import replace

import pytest
from shift_monitor.core import MonitorState, dump, load, step
from shift_monitor.gaze_input import gaze_input
from shift_schemas.errors import MalformedMessage
from shift_schemas.messages import Gaze, GazeChunk, Observation
from support.monitor_sessions import NOW, Recorded, configured_session, fixations, fold, last, names, points, session


def look(seq: int, start_s: float, x: float) -> GazeChunk:
    """Return fifty milliseconds of steady gaze at 100 Hz."""
    return points(seq, [round(start_s + i / 100, 6) for i in range(5)], [x] * 5, source="tx300")


def looks(first: int, start_s: float, x: float, n: int) -> list[GazeChunk]:
    return [look(first + i, round(start_s + i * 0.05, 6), x) for i in range(n)]


def gaze(facts: list[object]) -> list[Gaze]:
    return [f for f in facts if isinstance(f, Gaze)]


def test_tracker_that_restarts_its_numbers_continues_and_every_chunk_is_recorded() -> None:
    recorded = Recorded()
    state, before = fold(configured_session(), *looks(0, 100.0, 0.1, 200), recorded=recorded)
    _, after = fold(state, *looks(0, 110.0, 0.9, 200), recorded=recorded)
    assert last(before).gaze.aoi == "left"
    assert last(after).gaze.aoi == "right"
    assert (last(after).gaze.restarts, last(after).gaze.dropped, last(after).gaze.samples) == (1, 0, 2000)
    assert [(g.seq, g.segment, g.outcome) for g in gaze(after)] == [(n, 1, "applied") for n in range(200)]
    assert gaze(after)[0].warnings == [
        "gaze source tx300 sends another chunk 0 after chunk 199: segment 1 of the source begins"
    ]
    assert gaze(after)[1].warnings == []


@pytest.mark.parametrize(("before_s", "after_s"), [(3600.0, 0.0), (74701.0, 34.0), (1764000000.0, 1763999999.0)])
def test_clock_that_goes_back_is_a_restart_while_the_numbers_continue(before_s: float, after_s: float) -> None:
    state, _ = fold(configured_session(), *looks(0, before_s, 0.1, 20))
    _, facts = fold(state, *looks(20, after_s, 0.9, 60))
    assert last(facts).gaze.restarts == 1
    assert last(facts).gaze.aoi == "right"
    assert len(gaze(facts)) == 60
    assert "goes back from" in gaze(facts)[0].warnings[0]


def test_single_time_far_in_the_future_is_counted_and_the_next_chunk_is_applied() -> None:
    state, _ = fold(configured_session(), *looks(0, 10.0, 0.1, 20))
    state, jumped = fold(state, points(20, [1.7e9], [0.5], source="tx300"))
    assert "jumps forward" in gaze(jumped)[0].warnings[0]
    _, facts = fold(state, *looks(21, 11.0, 0.9, 60))
    view = last(facts).gaze
    assert (view.restarts, view.aoi) == (1, "right")
    assert view.lost == pytest.approx(0.0, abs=0.02)  # a jump counts as no time


def test_single_wrong_number_does_not_stop_the_source() -> None:
    state, _ = fold(configured_session(), look(0, 0.0, 0.1), look(2**40, 0.05, 0.1))
    _, facts = fold(state, *looks(1, 0.1, 0.9, 60))
    assert (last(facts).gaze.restarts, last(facts).gaze.aoi) == (1, "right")


def test_clock_that_jumps_forward_continues_without_dwell_in_between() -> None:
    state, before = fold(configured_session(), *looks(0, 10.0, 0.1, 20))
    _, facts = fold(state, *looks(20, 3611.0, 0.1, 20))
    assert last(facts).gaze.restarts == 0
    dwell_s, before_s = last(facts).gaze.dwell_s, last(before).gaze.dwell_s
    assert dwell_s is not None
    assert before_s is not None
    assert dwell_s - before_s == pytest.approx(1.0, abs=0.1)


def test_restart_ends_the_open_fixation_in_its_own_segment() -> None:
    recorded = Recorded()
    state, _ = fold(configured_session(), *looks(0, 100.0, 0.1, 10), recorded=recorded)
    _, facts = fold(state, *looks(0, 0.0, 0.9, 10), session("ending"), recorded=recorded)
    assert [(f.segment, f.aoi) for f in fixations(facts)] == [(0, "left"), (1, "right")]


def test_same_content_is_a_repeat_at_any_age_and_across_a_restart() -> None:
    recorded = Recorded()
    state, _ = fold(configured_session(), *looks(0, 0.0, 0.1, 300), *looks(0, 15.0, 0.9, 10), recorded=recorded)
    for chunk in (look(0, 0.0, 0.1), look(299, 14.95, 0.1), look(5, 15.25, 0.9)):
        again = step(state, gaze_input(chunk, recorded), NOW)
        assert (again.facts, again.repeat) == ((), True)
        assert replace(again.state, ledgers=state.ledgers) == state
        assert again.state.ledgers[chunk.source].repeated == state.ledgers[chunk.source].repeated + 1
        assert isinstance(again.result, dict)
        assert again.result["accepted"] == 5


def test_late_chunk_after_a_restart_belongs_to_the_new_segment() -> None:
    recorded = Recorded()
    state, _ = fold(configured_session(), *looks(0, 0.0, 0.1, 10), recorded=recorded)
    state, _ = fold(state, look(0, 10.0, 0.9), look(2, 10.1, 0.9), recorded=recorded)
    _, facts = fold(state, look(1, 10.05, 0.9), recorded=recorded)
    (late,) = gaze(facts)
    assert (late.outcome, late.segment) == ("late", 1)


def test_numbers_far_below_the_first_one_are_a_restart() -> None:
    state, _ = fold(configured_session(), *looks(1000, 100.0, 0.1, 20))
    _, facts = fold(state, *looks(0, 0.0, 0.9, 60))
    assert (last(facts).gaze.restarts, last(facts).gaze.aoi) == (1, "right")


def test_sample_at_the_time_of_the_last_one_is_refused() -> None:
    state, _ = fold(configured_session(), points(0, [1.0, 1.01, 1.02], [0.5] * 3))
    with pytest.raises(MalformedMessage, match=r"t must rise by 1 ns or more; the sample before was at 1\.02 s"):
        step(state, points(1, [1.02, 1.03], [0.5] * 2), NOW)


def test_session_of_format_1_accepts_restarts_and_records_no_quality() -> None:
    state = step(None, session().model_copy(update={"format": 1}), NOW).state
    state, facts = fold(
        MonitorState(**{**vars_of(configured_session()), "format": state.format}), *looks(0, 5.0, 0.1, 5)
    )
    state, facts = fold(state, *looks(5, 0.0, 0.9, 60))
    observation = facts[-1]
    assert isinstance(observation, Observation)
    assert observation.gaze.aoi == "right"
    assert (observation.gaze.restarts, observation.gaze.lost, observation.warnings) == (None, None, [])
    assert load(dump(state)) == state


def vars_of(state: MonitorState) -> dict[str, object]:
    return {name: getattr(state, name) for name in state.__slots__}


def test_source_of_names_can_restart() -> None:
    recorded = Recorded()
    state, _ = fold(configured_session(), names(0, [0.0, 1.0], ["left", "left"]), recorded=recorded)
    _, facts = fold(state, names(0, [0.5, 1.5], ["right", "right"]), recorded=recorded)
    assert (last(facts).gaze.restarts, last(facts).gaze.aoi) == (1, "right")
