"""The study file: defaults, ranges, conditions, and what can change while a session runs."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shift_schemas.errors import InvalidStudy
from shift_study.loading import (
    parse_study,
    patched,
    study_data,
    study_from_json,
    study_in_force,
    study_json,
    study_of,
)
from shift_study.patching import merge_patch
from shift_study.study import CHANGEABLE, Study, fixed_changes
from support.message_strategies import json_values
from support.study_texts import CONTRACT, OUT_OF_RANGE, PACE, SHOWN, written

EXAMPLES = {"title", "tasks", "aois", "conditions"}


def leaves(value: Any, path: str = "") -> dict[str, Any]:
    """Every value with its dotted path; lists are values."""
    if not isinstance(value, dict):
        return {path: value}
    return {p: v for key, inner in value.items() for p, v in leaves(inner, f"{path}.{key}".strip(".")).items()}


DEFAULTS = leaves({k: v for k, v in SHOWN.items() if k not in EXAMPLES | {"study"}})


@pytest.mark.parametrize(("path", "value"), DEFAULTS.items())
def test_every_default_is_the_contract_s(path: str, value: object) -> None:
    found = leaves(study_data(Study(study="x")))[path]
    assert found == value
    assert type(found) is type(value) or {type(found), type(value)} == {int, float}


def test_there_is_no_default_that_the_contract_does_not_show() -> None:
    more = {p for p in leaves(study_data(Study(study="x"))) if p not in DEFAULTS and not p.startswith("learner.")}
    assert more == {"study", "title", "aois", "scoring.s_max", "blinded", "decider.minimum_propensity"}, (
        "parameters of further learners aside"
    )


def test_the_contract_s_example_is_a_study() -> None:
    study = parse_study(CONTRACT)
    assert study.tasks == ["grasp", "turn", "pour"]
    assert study.aoi_names == ("robot", "cup")
    assert study.conditions == {"control": {"learner": {"name": "scoring"}}, "adaptive": {}}


def test_left_out_the_tasks_are_any_and_the_aois_thirds() -> None:
    study = Study(study="x")
    assert study.tasks is None
    assert study.aoi_names == ("left", "middle", "right")
    assert [a.rectangle for a in study.aois] == [[0, 0, 1 / 3, 1], [1 / 3, 0, 2 / 3, 1], [2 / 3, 0, 1, 1]]


# --- ranges ---


@pytest.mark.parametrize(("path", "value"), OUT_OF_RANGE, ids=str)
def test_a_value_out_of_range_is_refused_with_file_line_value_and_rule(path: str, value: object) -> None:
    text, line = written(path, value)
    with pytest.raises(InvalidStudy) as refused:
        parse_study(text, "mine.yaml")
    said = refused.value
    field = said.errors[0].field
    assert path.startswith(field) or field.startswith(path), "the field, the part that it belongs to, or an entry of it"
    at = line - max(0, path.count(".") - field.count("."))
    assert said.detail.startswith(f"mine.yaml:{at}: {field}: ")
    shown = [str(v) for v in value] if isinstance(value, list) else [str(value)]
    assert any(v[:60] in said.detail for v in shown) or value == []
    assert len(said.errors[0].rule) > 15


def test_the_sentence_says_what_to_write_instead() -> None:
    with pytest.raises(InvalidStudy) as refused:
        parse_study("study: x\nlearner:\n  learning_rate: 1.5\n", "mine.yaml")
    assert refused.value.detail == (
        "mine.yaml:3: learner.learning_rate: '1.5' is not valid: it must be at most 1; it is a share of one; "
        "write for example the default, 0.25"
    )


def test_parts_that_do_not_fit_together_are_named_with_their_values() -> None:
    for text, line, says in (
        ("capacity: {start: 0.4, min: 0.5}", 2, "0.5 <= 0.4 <= 1.0"),
        ("attention:\n  weight_min: 0.4", 3, "attention.weight_min is 0.4; times 3 AOIs"),
        ("attention:\n  distracted_dominance: 0.6", 3, "is 0.6; it must not exceed attention.focused"),
        ("capacity:\n  demanding: [shouting]", 3, "names shouting; the strategies' levels are affirmation, hesitation"),
        ("aois: [{name: a, rectangle: [0.5, 0, 0.1, 1]}]", 2, "it is [0.5, 0.0, 0.1, 1.0]"),
        ("aois: [{name: a}]", 2, "either rectangle"),
        ("aois:\n- &a {name: a, rectangle: [0, 0, 1, 1]}\n- *a", 2, "AOI names must differ"),
        ("aois: [{name: a, polygon: [[0, 0], [1, 1]]}]", 2, "it has 2 entries and needs at least 3"),
        ("aois: [{name: a, rectangle: [0, 0, 1, 1.5]}]", 2, "it is a share of the stimulus' height"),
        ("conditions:\n  a: {tasks: [x]}", 3, "overrides tasks; it can override attention"),
        ("conditions:\n  a:\n    reward: {decay: -1}", 4, "conditions.a.reward.decay: '-1' is not valid"),
        ("conditions: {'a/b': {}}", 2, "'a/b' is not an id: 1 to 63 letters"),
        ("scoring: {strategies: {p: {levels: [a, b], thresholds: [0.5]}}}", 2, "capacity.low.p: it is missing; write"),
    ):  # fmt: skip
        with pytest.raises(InvalidStudy) as refused:
            parse_study(f"study: x\n{text}", "mine.yaml")
        assert refused.value.detail.startswith(f"mine.yaml:{line}: "), refused.value.detail
        assert says in refused.value.detail


# --- the scoring system's strategies ---


def test_a_third_strategy_is_a_column_more_and_the_last_is_fastest() -> None:
    scoring = parse_study(PACE).scoring
    assert list(scoring.strategies) == ["negation", "hesitation", "pace"]
    assert len(scoring.actions) == 12
    assert scoring.actions[:3] == (
        ("affirmation", "none", "slow"), ("affirmation", "none", "fast"), ("affirmation", "hesitation", "slow"),
    )  # fmt: skip
    assert scoring.states[0] == "affirmation+none+slow"


def test_null_takes_a_strategy_out_with_its_column() -> None:
    study = parse_study("study: x\nscoring: {strategies: {hesitation: null}}\n")
    assert list(study.scoring.strategies) == ["negation"]
    assert study.scoring.states == ("affirmation", "negation_affirmation", "negation")
    assert study.scoring.table.gaze.focused == {"negation": 0}
    assert study_of(study_data(study)) == study


def test_the_actions_follow_the_strategies_as_listed() -> None:
    study = parse_study("study: x\nscoring: {strategies: {hesitation: {}, negation: {}}}")
    assert study.scoring.actions[1] == ("none", "negation_affirmation")
    assert study_of(study_data(study)) == study


def test_a_part_that_is_left_out_stays_the_default_s() -> None:
    study = parse_study(
        "study: x\nscoring: {strategies: {negation: {weight: 1.25}}, table: {gaze: {focused: {negation: 1}}}}"
    )
    assert study.scoring.strategies["negation"].thresholds == [0.5, 0.8333333333333334]
    assert study.scoring.table.gaze.focused == {"negation": 1, "hesitation": 0}
    assert study.scoring.table.gaze.distracted == {"negation": 1, "hesitation": 1}


def test_more_actions_than_can_be_learned_about_are_refused() -> None:
    levels = {"levels": list("abcdefgh"), "thresholds": [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7]}
    rows = {"low": {"p": 0, "q": 0}, "high": {"p": 0, "q": 0}}
    table = {
        part: {row: {"p": 0, "q": 0} for row in names}
        for part, names in study_data(Study(study="x"))["scoring"]["table"].items()
    }
    assert table["capacity"] == rows
    with pytest.raises(InvalidStudy, match="384 actions; at most 64"):
        study_of({"study": "x", "scoring": {"strategies": {"p": levels, "q": levels}, "table": table}})


# --- conditions ---


def test_a_condition_overrides_parts_and_leaves_the_rest() -> None:
    study = parse_study(CONTRACT)
    control = study_in_force(study, "control")
    assert control.learner.name == "scoring"
    assert control.learner.epsilon == 0.75
    assert control.model_copy(update={"learner": study.learner}) == study
    assert study_in_force(study, "adaptive") == study_in_force(study, None) == study


def test_an_unknown_condition_is_refused_with_those_that_there_are() -> None:
    with pytest.raises(InvalidStudy, match="has no condition 'x'; it has control, adaptive"):
        study_in_force(parse_study(CONTRACT), "x")
    with pytest.raises(InvalidStudy, match="it has none"):
        study_in_force(Study(study="x"), "x")


def test_a_condition_can_take_a_strategy_out() -> None:
    study = parse_study("study: x\nconditions: {plain: {scoring: {strategies: {hesitation: null}}}}")
    assert list(study_in_force(study, "plain").scoring.strategies) == ["negation"]
    assert list(study_in_force(study, None).scoring.strategies) == ["negation", "hesitation"]


def test_a_condition_can_take_out_a_strategy_of_the_study_s_own() -> None:
    study = parse_study(PACE + "conditions: {two: {scoring: {strategies: {pace: null}}}}")
    assert study_in_force(study, "two").scoring == Study(study="x").scoring


def test_a_condition_s_null_is_the_default_again() -> None:
    study = parse_study("study: x\nreward: {decay: 0.2}\nconditions: {paper: {reward: null}}")
    assert study_in_force(study, "paper").reward.decay == 0.1


# --- RFC 7386 ---

RFC_7386 = [
    ({"a": "b"}, {"a": "c"}, {"a": "c"}), ({"a": "b"}, {"b": "c"}, {"a": "b", "b": "c"}), ({"a": "b"}, {"a": None}, {}),
    ({"a": "b", "b": "c"}, {"a": None}, {"b": "c"}), ({"a": ["b"]}, {"a": "c"}, {"a": "c"}),
    ({"a": "c"}, {"a": ["b"]}, {"a": ["b"]}), ({"a": {"b": "c"}}, {"a": {"b": "d", "c": None}}, {"a": {"b": "d"}}),
    ({"a": [{"b": "c"}]}, {"a": [1]}, {"a": [1]}), (["a", "b"], ["c", "d"], ["c", "d"]), ({"a": "b"}, ["c"], ["c"]),
    ({"a": "foo"}, None, None), ({"a": "foo"}, "bar", "bar"), ({"e": None}, {"a": 1}, {"e": None, "a": 1}),
    ([1, 2], {"a": "b", "c": None}, {"a": "b"}), ({}, {"a": {"bb": {"ccc": None}}}, {"a": {"bb": {}}}),
]  # fmt: skip
"""The test cases of the RFC's appendix A."""


@pytest.mark.parametrize(("target", "patch", "result"), RFC_7386)
def test_merging_follows_rfc_7386(target: object, patch: object, result: object) -> None:
    assert merge_patch(target, patch) == result


@given(json_values, json_values)
def test_merging_changes_neither_side(target: object, patch: object) -> None:
    before = repr((target, patch))
    merge_patch(target, patch)
    assert repr((target, patch)) == before


# --- round trips ---

probability = st.floats(0, 1)
amount = st.floats(0, 1e6)
studies = st.builds(
    lambda parts, conditions, taken_out: study_of(
        {"study": "x", **parts, "conditions": conditions}
        | ({"scoring": {"strategies": {taken_out: None}}, "capacity": {"demanding": []}} if taken_out else {})
    ),
    st.fixed_dictionaries(
        {},
        optional={
            "title": st.text(st.characters(exclude_categories=["Cs"]), max_size=30),
            "tasks": st.lists(st.sampled_from(["a", "b", "c"]), min_size=1, unique=True),
            "interactions": st.integers(1, 100_000),
            "reward": st.fixed_dictionaries({}, optional={"decay": amount, "scale": amount}),
            "awareness": st.fixed_dictionaries({}, optional={"window": st.integers(1, 99), "threshold": probability}),
            "learner": st.fixed_dictionaries({}, optional={"epsilon": probability, "discount": probability}),
            "decider": st.fixed_dictionaries({"wait_s": st.floats(0, 10)}),
        },
    ),
    st.dictionaries(
        st.sampled_from(["p", "q"]),
        st.fixed_dictionaries({}, optional={"reward": st.none(), "learner": st.just({"epsilon": 0.5})}),
    ),
    st.sampled_from(["", "hesitation", "negation"]),
)


@given(studies)
def test_a_study_survives_its_plain_form_and_its_json(study: Study) -> None:
    assert study_of(study_data(study)) == study
    assert study_from_json(study_json(study)) == study
    if study.title.isprintable():
        assert parse_study(study_json(study)) == study, "JSON is a study file as well"


@given(studies)
def test_an_empty_patch_changes_nothing(study: Study) -> None:
    assert patched(study, {}) == study
    assert fixed_changes(study, patched(study, {})) == ()


# --- what can change while a session runs ---

ALLOWED: list[dict[str, Any]] = [
    {"scoring": {"strategies": {"negation": {"weight": 1.25}}}},
    {"scoring": {"strategies": {"negation": {"thresholds": [0.4, 0.9]}}}},
    {"scoring": {"table": {"gaze": {"focused": {"negation": 1}}}}},
    {"scoring": {"s_max": 2.0}},
    {"capacity": {"recovery": 0.5}}, {"capacity": None}, {"attention": {"weight_step": 0.2}},
    {"awareness": {"window": 3}}, {"reward": {"scale": 2}}, {"decider": {"wait_s": 30}},
    {"learner": {"epsilon": 0.1, "discount": 0.5, "scoring_prior": False}},
]  # fmt: skip
FIXED: list[tuple[dict[str, Any], tuple[str, ...]]] = [
    ({"study": "y"}, ("study",)), ({"title": "other"}, ("title",)), ({"tasks": ["a"]}, ("tasks",)),
    ({"aois": [{"name": "a", "rectangle": [0, 0, 1, 1]}]}, ("aois",)), ({"conditions": {"a": {}}}, ("conditions",)),
    ({"interactions": 50}, ("interactions",)), ({"fixation": {"dispersion_deg": 1.5}}, ("fixation",)),
    ({"learner": {"name": "scoring"}}, ("learner.name",)),
    ({"scoring": {"strategies": {"hesitation": None}}}, ("scoring.strategies",)),
    ({"scoring": {"strategies": {"negation": {"levels": ["a", "b", "c"]}}}, "capacity": {"demanding": []}},
     ("scoring.strategies.negation.levels",)),
    ({"interactions": 50, "reward": {"scale": 2}, "title": "other"}, ("title", "interactions")),
]  # fmt: skip


@pytest.mark.parametrize("patch", ALLOWED, ids=str)
def test_what_can_change_is_named_nowhere(patch: dict[str, Any]) -> None:
    before = Study(study="x", title="t")
    assert fixed_changes(before, patched(before, patch)) == ()
    assert set(patch) <= CHANGEABLE


@pytest.mark.parametrize(("patch", "names"), FIXED, ids=str)
def test_what_is_fixed_is_named(patch: dict[str, Any], names: tuple[str, ...]) -> None:
    before = Study(study="x", title="t")
    assert fixed_changes(before, patched(before, patch)) == names


def test_a_strategy_more_and_another_order_are_refused_by_name() -> None:
    two, three = Study(study="x"), parse_study(PACE.replace("paced", "x"))
    turned = parse_study("study: x\nscoring: {strategies: {hesitation: {}, negation: {}}}")
    assert (
        fixed_changes(two, three) == fixed_changes(three, two) == fixed_changes(two, turned) == ("scoring.strategies",)
    )
