"""Messages: frozen facts, and the rules of a gaze chunk's columns."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError
from shift_schemas.core_protocol import covers
from shift_schemas.messages import (
    Configure,
    Decide,
    GazeChunk,
    Policy,
    ReportPerformance,
    Result,
    Seen,
    SetOverride,
)
from shift_schemas.registry import FACTS

POINTS: dict[str, Any] = {"source": "tx300", "seq": 0, "t": [0.0, 0.1], "x": [0.5, None], "y": [0.5, None]}
NAMES: dict[str, Any] = {"source": "ros", "seq": 0, "t": [0.0, 0.1], "aoi": ["robot", None]}


@pytest.mark.parametrize(
    "chunk",
    [POINTS, NAMES, POINTS | {"valid": [True, False]}, POINTS | {"valid": [False, False]},
     NAMES | {"aoi": [None, None]}, POINTS | {"x": [0, 1], "y": [0, 1]}, POINTS | {"x": [-0.3, 1.4], "y": [0.1, 0.1]},
     NAMES | {"seq": 2**53}],
)  # fmt: skip
def test_chunk_has_points_or_names(chunk: dict[str, Any]) -> None:
    assert GazeChunk.model_validate(chunk).t == [0.0, 0.1]


@pytest.mark.parametrize(
    ("change", "says"),
    [({"aoi": ["robot", None]}, "either aoi"), ({"x": None}, "either aoi"), ({"y": None}, "either aoi"),
     ({"x": [0.5]}, "x has 1 entries and t has 2"), ({"y": [0.5] * 3}, "y has 3 entries"),
     ({"valid": [True]}, "valid has 1 entries"), ({"valid": [True, True]}, "sample 1 is valid and has no x or y"),
     ({"t": [0.1, 0.1]}, "t must rise"), ({"t": [0.1, 0.0]}, "t must rise"),
     ({"t": [], "x": [], "y": []}, "at least 1"),
     ({"t": [0.0, 1e12]}, "less than or equal"), ({"seq": -1}, "greater than or equal"), ({"seq": 2**53 + 1}, "less"),
     ({"seq": 0.5}, "integer"), ({"source": "a/b"}, "match pattern"), ({"t": [0.0, True]}, "number"),
     ({"valid": [1, 0]}, "boolean"), ({"pupil": [3.0, 3.0]}, "not permitted")],
)  # fmt: skip
def test_columns_of_different_length_or_content_are_refused(change: dict[str, Any], says: str) -> None:
    with pytest.raises(ValidationError, match=says):
        GazeChunk.model_validate(POINTS | change)


def test_chunk_of_names_has_no_points() -> None:
    for column in ("x", "y", "valid"):
        with pytest.raises(ValidationError, match="either aoi"):
            GazeChunk.model_validate(NAMES | {column: [0.0, 0.0] if column != "valid" else [True, True]})
    with pytest.raises(ValidationError, match="aoi has 1 entries"):
        GazeChunk.model_validate(NAMES | {"aoi": ["robot"]})


@pytest.mark.parametrize("duration", [-0.1, float("nan"), float("inf"), 1e7, True, "5"])
def test_invalid_duration_is_refused(duration: object) -> None:
    with pytest.raises(ValidationError):
        Result.model_validate({"success": True, "duration_s": duration})


def test_facts_are_frozen_and_refuse_unknown_fields() -> None:
    for kind in FACTS.values():
        assert kind.model_config.get("frozen")
        assert kind.model_config.get("extra") == "forbid"
    seen = Seen(decision=1)
    with pytest.raises(ValidationError):
        seen.decision = 2  # type: ignore[misc]


def test_content_of_a_repeat_does_not_depend_on_what_was_read() -> None:
    first = Decide(command_id="d1", session="s1", task="grasp", need=Seen(decision=1))
    again = Decide(command_id="d1", session="s1", task="grasp", need=Seen(decision=2))
    other = Decide(command_id="d1", session="s1", task="turn", need=Seen(decision=1))
    assert first.content() == again.content() != other.content()


def test_order_of_the_strategies_does_not_change_an_override() -> None:
    levels = {"negation": "negation", "hesitation": "none"}
    first = SetOverride(command_id="o1", session="s1", task="grasp", strategy=levels)
    turned = SetOverride(command_id="o1", session="s1", task="grasp", strategy=dict(reversed(levels.items())))
    assert first.content() == turned.content()


def test_every_report_names_both_dimensions() -> None:
    with pytest.raises(ValidationError):
        ReportPerformance.model_validate(
            {"command_id": "d1", "session": "s1", "comprehension": {"success": True, "duration_s": 1.0}}
        )


def test_policy_accepts_the_contract_s_learners() -> None:
    learners = Policy.model_json_schema()["properties"]["learner"]["enum"]
    assert learners == ["scoring", "q-learning", "epsilon-greedy", "ucb1", "thompson", "linear-thompson", "planner"]


@pytest.mark.parametrize("value", [float("inf"), float("nan"), "\ud800", {"\ud800": 1}, [[float("-inf")]]])
def test_patch_that_is_not_json_is_refused(value: object) -> None:
    with pytest.raises(ValidationError):
        Configure(command_id="c1", session="s1", patch={"a": value})


# --- how far somebody has read ---

counts = st.integers(0, 3)
seens = st.builds(
    Seen, gaze=st.dictionaries(st.sampled_from(["a", "b"]), counts), decision=counts, performance=counts,
    config=counts, observation=counts, policy=counts,
)  # fmt: skip


@given(seens, seens)
def test_seen_covers_another_if_no_count_is_below(a: Seen, b: Seen) -> None:
    mine, needed = a.model_dump(), b.model_dump()
    gaze, wanted = mine.pop("gaze"), needed.pop("gaze")
    below = [name for name in needed if mine[name] < needed[name]]
    below += [source for source in wanted if source not in gaze or gaze[source] < wanted[source]]
    assert covers(a, b) == (not below)
    assert covers(a, a)


def test_chunk_0_of_a_source_is_more_than_no_chunk() -> None:
    assert not covers(Seen(), Seen(gaze={"tx300": 0}))
    assert covers(Seen(gaze={"tx300": 0}), Seen(gaze={"tx300": 0}))
