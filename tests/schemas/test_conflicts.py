"""A command id with another content: the refusal names the differences and the remedy."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shift_schemas.conflicts import differences, repeat_conflict
from shift_schemas.messages import (
    Command,
    Decide,
    EndSession,
    Mark,
    ReportPerformance,
    Result,
    SetOverride,
    StartSession,
)
from shift_schemas.registry import COMMANDS


def refused(before: Command, now: Command) -> str:
    return repeat_conflict(now, before.content()).detail


def start(**given: Any) -> StartSession:
    return StartSession(**{"command_id": "start", "session": "s1", "participant": "P01", **given})


@pytest.mark.parametrize(
    ("before", "now", "then_says", "now_says"),
    [
        ({}, {"participant": "P02"}, "participant P01", "participant P02"),
        ({"study": "coffee"}, {"study": "default"}, "study coffee", "study default"),
        ({"condition": "control"}, {"condition": "adaptive"}, "condition control", "condition adaptive"),
        ({"condition": "control"}, {}, "condition control", "no condition"),
        ({}, {"seed": 7}, "no seed", "seed 7"),
        ({"seed": 8}, {"seed": 7, "participant": "P02"}, "participant P01 and seed 8", "participant P02 and seed 7"),
        (
            {"study": {"study": "x", "capacity": {"recovery": 0.3}}},
            {"study": {"study": "x", "capacity": {"recovery": 0.4}}},
            "study.capacity.recovery 0.3",
            "study.capacity.recovery 0.4",
        ),
    ],
    ids=str,
)
def test_start_under_a_used_session_names_both_values(
    before: dict[str, Any], now: dict[str, Any], then_says: str, now_says: str
) -> None:
    said = refused(start(**before), start(**now))
    assert said == (
        f"session s1 is there already, with {then_says}; this start says {now_says}. Choose another session id."
    )


@pytest.mark.parametrize(
    ("before", "now", "says"),
    [
        (
            Decide(command_id="d1", session="s1", task="grasp"),
            Decide(command_id="d1", session="s1", task="turn"),
            ("decision d1 was made before, with task grasp; this request says task turn. "
            "Choose another decision_id for another decision."),
        ),
        (
            Mark(command_id="m1", session="s1", text="the phone rang"),
            Mark(command_id="m1", session="s1", text=""),
            ('marker m1 was set before, with text "the phone rang"; this marker says text "". '
            "Choose another marker_id for another marker."),
        ),
        (
            SetOverride(command_id="o1", session="s1", task="grasp", strategy={"negation": "negation"}),
            SetOverride(command_id="o1", session="s1", task="grasp", strategy={"negation": "affirmation"}),
            ("override o1 was set before, with strategy.negation negation; this override says strategy.negation "
            "affirmation. Choose another override_id for another override."),
        ),
        (
            ReportPerformance(
                command_id="d1", session="s1",
                comprehension=Result(success=True, duration_s=5.0), enabledness=Result(success=True, duration_s=6.0),
            ),
            ReportPerformance(
                command_id="d1", session="s1",
                comprehension=Result(success=False, duration_s=5.0), enabledness=Result(success=True, duration_s=9.0),
            ),
            ("decision d1 has its report already, with comprehension.success true and enabledness.duration_s 6.0; this "
            "report says comprehension.success false and enabledness.duration_s 9.0. To replace the first report, send "
            'this one with "corrects": true; for another decision, send that decision\'s decision_id.'),
        ),
    ],
    ids=["decide", "mark", "override", "report"],
)  # fmt: skip
def test_refusal_names_the_thing_the_difference_and_the_remedy(before: Command, now: Command, says: str) -> None:
    assert refused(before, now) == says


def test_differing_fields_are_errors_of_their_own() -> None:
    found = repeat_conflict(start(participant="P02", seed=7), start().content())
    assert [(e.field, e.value, e.rule) for e in found.errors] == [
        ("participant", "P02", "it was P01 the first time"),
        ("seed", "7", "it was left out the first time"),
    ]
    assert found.status == 409


def test_many_differences_and_long_values_make_one_short_sentence() -> None:
    many = {f"k{i}": "x" * 5000 for i in range(100)}
    said = refused(start(study={"study": "x"}), start(study={"study": "x", **many}))
    assert "and 96 more" in said
    assert len(said) < 1000


def test_refusal_without_the_first_content_names_the_thing_and_the_remedy() -> None:
    found = repeat_conflict(start(), "0123456789abcdef")
    assert found.detail == "session s1 is there already, with another content. Choose another session id."


@pytest.mark.parametrize("kind", COMMANDS.values(), ids=COMMANDS)
def test_each_command_has_its_own_wording(kind: type[Command]) -> None:
    assert kind.wording != Command.wording


def test_command_without_its_own_wording_is_refused_in_general_words() -> None:
    class Wave(Command):
        owner = "decider"
        procedure = "wave"

    found = repeat_conflict(Wave(command_id="w1", session="s1"), "")
    assert found.detail == "wave w1 was asked before, with another content. Choose another id for another request."


def test_end_always_has_the_same_content() -> None:
    assert differences(*[EndSession(command_id="end", session="s1").content()] * 2) == []


JSON = st.recursive(st.none() | st.booleans() | st.integers(-5, 5) | st.text(max_size=3), lambda v: st.lists(v) | (
    st.dictionaries(st.sampled_from("abc"), v)), max_leaves=8)  # fmt: skip


@given(st.dictionaries(st.sampled_from("abc"), JSON))
def test_another_order_of_the_fields_is_not_a_difference(content: dict[str, Any]) -> None:
    import json

    turned = dict(reversed(content.items()))
    assert differences(json.dumps(content), json.dumps(turned)) == []
