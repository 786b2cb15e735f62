"""The JSON inside ROS messages."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shift_ros2.mapping import (
    aois_of,
    gaze_of,
    performance_of,
    task_of,
    text_of_answer,
    text_of_error,
    text_of_fact,
)
from shift_schemas.errors import Conflict, FieldError, MalformedMessage, Problem, ShiftError
from shift_schemas.messages import CapacityView, GazeChunk, GazeView, Observation
from shift_schemas.timestamps import Stamp
from shift_sources.gaze_batching import GazeArrival

NOW_S = 1000.0
RESULT = {"success": True, "duration_s": 5.0}


def gaze(**data: Any) -> GazeArrival:
    return gaze_of(json.dumps(data), "ros", NOW_S)


def test_a_chunk_is_taken_as_it_is() -> None:
    found = gaze(session="s2", source="tx300", seq=4, t=[0.0, 0.1], x=[0.5, None], y=[0.5, None], valid=[True, False])
    chunk = GazeChunk(source="tx300", seq=4, t=[0.0, 0.1], x=[0.5, None], y=[0.5, None], valid=[True, False])
    assert found == GazeArrival("s2", chunk, True)


def test_a_sample_is_a_chunk_of_one_that_the_bridge_numbers() -> None:
    assert gaze(t=2, x=0.5, y=0.25) == GazeArrival(
        None, GazeChunk(source="ros", seq=0, t=[2.0], x=[0.5], y=[0.25]), False
    )
    assert gaze(t=2.0, aoi=None).chunk.aoi == [None]
    assert gaze(aoi="robot").chunk.t == [NOW_S], "without a time it has the bridge's"
    assert gaze(seq=7, t=2.0, aoi="robot").numbered


@pytest.mark.parametrize(
    ("data", "field", "value", "rule"),
    [
        ({"t": "soon", "aoi": "robot"}, "t", "soon", "number"),
        ({"t": True, "aoi": "robot"}, "t", "True", "number"),
        ({"t": 1.0, "x": "left", "y": 0.5}, "x", "left", "number"),
        ({"t": [1.0, 1.0], "aoi": ["a", "b"]}, "body", "", "rise"),
        ({"t": [1.0, 2.0], "aoi": ["a"]}, "body", "", "as many"),
        ({"t": 1.0}, "body", "", "either aoi"),
        ({"t": 1.0, "aoi": "a", "session": 5}, "session", "5", "string"),
        ({"t": 1.0, "aoi": "a", "source": "../a"}, "source", "../a", "for example a"),
        ({"t": 1.0, "aoi": "a", "extra": 1}, "extra", "1", "not permitted"),
        ({"t": 1.0, "aoi": "a", "seq": -1}, "seq", "-1", "greater"),
        ({"t": 1.0, "aoi": "\ud800"}, "data", "", "surrogate"),
    ],
)
def test_mistakes_in_gaze_are_said_with_field_value_and_rule(
    data: dict[str, Any], field: str, value: str, rule: str
) -> None:
    with pytest.raises(MalformedMessage) as caught:
        gaze(**data)
    first = caught.value.errors[0]
    assert first.field == field
    assert value in first.value
    assert rule in first.rule


def test_task_and_performance_are_strict() -> None:
    assert task_of('{"task": "grasp", "session": "s2"}').session == "s2"
    report = performance_of(json.dumps({"decision_id": "d1", "comprehension": RESULT, "enabledness": RESULT}))
    assert report.session is None
    assert report.body.decision_id == "d1"
    for text in ('{"task": ""}', "{}", '{"task": "a", "more": 1}', "5", "null", '"text"'):
        with pytest.raises(MalformedMessage):
            task_of(text)
    with pytest.raises(MalformedMessage, match=r"comprehension\.success"):
        performance_of(
            json.dumps({"decision_id": "d", "comprehension": {"success": 1, "duration_s": 1}, "enabledness": RESULT})
        )


JSON = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=8,
)
FIELDS = st.sampled_from(["t", "x", "y", "valid", "aoi", "seq", "source", "session", "task", "decision_id", "foo"])


def _refusal(read: Callable[[str], object], text: str) -> ShiftError | None:
    try:
        read(text)
    except ShiftError as e:
        return e
    return None


@given(st.text(max_size=50) | st.dictionaries(FIELDS, JSON, max_size=6).map(json.dumps))
def test_any_text_is_a_message_or_refused(text: str) -> None:
    for read in (task_of, performance_of, lambda t: gaze_of(t, "ros", NOW_S)):
        refused = _refusal(read, text)
        assert refused is None or (refused.detail and all(len(f.value) <= 80 for f in refused.errors))


def test_what_is_too_large_is_refused() -> None:
    with pytest.raises(ShiftError, match="256 KB"):
        gaze_of("x" * 300_000, "ros", NOW_S)


def test_answers_and_refusals_are_json() -> None:
    assert json.loads(text_of_answer({"decision_id": "d", "task": "fünf"})) == {"decision_id": "d", "task": "fünf"}
    error = Conflict("ended", (FieldError(field="session", value="s1", rule="live"),))
    back = Problem.model_validate_json(text_of_error(error)).error()
    assert (type(back), back.detail, back.errors) == (Conflict, "ended", error.errors)


def test_an_observation_on_its_topic_is_that_of_rest() -> None:
    fact = Observation(
        session="s1", stamp=Stamp(sec=1, nsec=0), version=1, awareness={},
        capacity=CapacityView(value=1.0, category="high"),
        gaze=GazeView(category="focused", weights={"a": 1.0}, focus_shift=0.0, aoi="", fixations=0, dropped=0),
    )  # fmt: skip
    assert json.loads(text_of_fact(fact, fact.model_dump_json()))["gaze"]["aoi"] is None


def test_aois_that_move_get_what_the_message_leaves_out() -> None:
    moved = [{"name": "cup", "rectangle": [0.1, 0.2, 0.3, 0.4]}]
    found = aois_of(json.dumps({"aois": moved, "session": "s2"}), "ros", NOW_S)
    assert found.session == "s2"
    assert (found.positions.source, found.positions.t, found.positions.seq) == ("ros", NOW_S, 1_000_000)
    given = {"source": "tx300", "t": 1.25, "seq": 3, "aois": [{"name": "cup", "visible": False}]}
    assert aois_of(json.dumps(given), "ros", NOW_S).positions.model_dump(exclude_unset=True) == given


def test_mistakes_in_aois_are_said_with_field_and_rule() -> None:
    with pytest.raises(MalformedMessage, match="less than or equal to 2") as e:
        aois_of(json.dumps({"aois": [{"name": "cup", "rectangle": [10, 20, 300, 400]}]}), "ros", NOW_S)
    assert e.value.errors[0].field == "aois.0.rectangle.0"
