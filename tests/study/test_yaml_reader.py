"""Study files are read as written: words stay words, and a number is what YAML 1.2 says."""

from __future__ import annotations

import json
import math
import warnings
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shift_schemas.errors import InvalidStudy
from shift_study.loading import parse_study, study_data, study_of
from shift_study.study import Study
from shift_study.yaml_numbers import core_number, core_value
from shift_study.yaml_reader import read_yaml
from shift_study.yaml_writer import write_yaml
from support.message_strategies import json_values

WORDS = ["yes", "no", "on", "off", "true", "y", "n", "01", "010", "1", "2024", "2024-01-01", "1e3", "0x1F", "1_000"]


def refusal(text: str) -> str:
    """What is said of a study file."""
    with pytest.raises(InvalidStudy) as refused:
        parse_study(f"study: x\n{text}", "mine.yaml")
    assert len(refused.value.sentences) == len(refused.value.errors) or not refused.value.errors
    return refused.value.detail


# --- words ---


@pytest.mark.parametrize("word", WORDS)
def test_where_a_word_is_expected_it_stays_as_written(word: str) -> None:
    study = parse_study(
        f"study: {word}\ntitle: {word}\ntasks: [{word}, other]\naois:\n  - {{name: {word}, rectangle: [0, 0, 1, 1]}}\n"
        f"conditions:\n  {word}: {{}}\n"
    )
    assert (study.study, study.title, study.tasks) == (word, word, [word, "other"])
    assert study.aoi_names == (word,)
    assert list(study.conditions) == [word]


@pytest.mark.parametrize("word", WORDS)
def test_quotes_make_no_difference_where_a_word_is_expected(word: str) -> None:
    assert parse_study(f"study: 'x'\ntasks: ['{word}', \"b\"]").tasks == [word, "b"]


def test_levels_and_strategies_stay_as_written() -> None:
    rows = {
        part: {row: {"on": 1} for row in rows}
        for part, rows in study_data(Study(study="x"))["scoring"]["table"].items()
    }
    strategies = "{on: {levels: [off, yes], thresholds: [0.5]}}"
    study = parse_study(f"study: x\nscoring:\n  strategies: {strategies}\n  table: {json.dumps(rows)}\n")
    assert study.scoring.strategies["on"].levels == ["off", "yes"]
    assert study.scoring.choices[0]["on"] == "off"


def test_words_that_yaml_1_1_makes_equal_are_two_conditions() -> None:
    study = parse_study(
        "study: swap\nconditions:\n  01: {learner: {name: scoring}}\n  1: {}\n  010: {}\n  8: {}\n  on: {}\n  yes: {}"
    )
    assert list(study.conditions) == ["01", "1", "010", "8", "on", "yes"]


@pytest.mark.parametrize(("one", "two"), [("1", '"1"'), ("true", '"true"'), ("no", "'no'"), ("on", "on"), ('"a"', "a")])
def test_a_key_is_given_twice_where_its_final_value_is(one: str, two: str) -> None:
    name = one.strip("'\"")
    said = refusal(f"conditions:\n  {one}: {{learner: {{name: scoring}}}}\n  {two}: {{}}")
    assert said.startswith(f"mine.yaml:4: conditions.{name}: it is given twice, first in line 3")


def test_every_mistake_of_the_text_is_said_at_once() -> None:
    said = refusal("tasks: [a]\ntasks: [b]\naois:\nlearner: {epsilon: 0,75}\n")
    assert "mine.yaml:3: tasks: it is given twice" in said
    assert "mine.yaml:4: aois: nothing is written here" in said
    assert "mine.yaml:5: learner.epsilon: '0,75' is not valid: the comma ends the entry; write 0.75" in said


# --- numbers and booleans ---


@pytest.mark.parametrize(
    ("text", "value"),
    [("010", 10), ("0o10", 8), ("0x10", 16), ("+7", 7), ("-7", -7), ("1.", 1.0), (".5", 0.5), ("1e3", 1000.0),
     ("1E-3", 0.001), ("-.inf", -math.inf), ("true", True), ("False", False), ("null", None), ("~", None),
     ("", None), ("yes", "yes"), ("off", "off"), ("1_000", "1_000"), ("1:05", "1:05"), ("2024-01-01", "2024-01-01"),
     ("1e", "1e"), ("0b1", "0b1"), ("0o9", "0o9"), ("9" * 5000, "9" * 5000)],
    ids=lambda v: str(v)[:12],
)  # fmt: skip
def test_a_plain_value_is_what_the_core_schema_says(text: str, value: object) -> None:
    found = core_value(text)
    assert found == value
    assert type(found) is type(value)


@given(st.floats(allow_nan=False) | st.integers(-(10**20), 10**20))
def test_a_number_that_json_writes_is_that_number(number: float) -> None:
    if math.isfinite(number):
        assert core_number(json.dumps(number)) == number


def test_a_leading_zero_makes_no_octal_number() -> None:
    assert parse_study("study: x\ninteractions: 010").interactions == 10


@pytest.mark.parametrize(
    ("text", "says"),
    [("interactions: 1_000", "'1_000' is not valid: a number has no _; write 1000"),
     ("interactions: 100.0", "'100.0' is not valid: it must be a whole number; write 100"),
     ("fixation: {distance_cm: 1:05}", "'1:05' is not valid: a number has no colon; write one number, in cm"),
     ("fixation: {distance_cm: 65 cm}", "'65 cm' is not valid: write the number alone, 65, in cm"),
     ("fixation:\n  distance_cm: 65,5", "'65,5' is not valid: a number has a point, not a comma; write 65.5"),
     ("learner: {epsilon: 0,75}", "learner.epsilon: '0,75' is not valid: the comma ends the entry; write 0.75"),
     ("learner: {epsilon: 75%}", "'75%' is not valid: write the share of one without the sign, 0.75"),
     ("learner: {epsilon: '0.75'}", "it is text and a number is expected; write 0.75 without quotes"),
     ("learner: {epsilon: 75}", "'75' is not valid: it must be at most 1; 75 % is written 0.75"),
     ("learner: {epsilon: 3/4}", "'3/4' is not valid: a fraction is written out; write 0.75"),
     ("learner: {epsilon: much}", "'much' is not valid: a number is expected; write for example the default, 0.75"),
     ("learner: {epsilon: true}", "'True' is not valid"),
     ("learner: {scoring_prior: no}", "'no' is not valid: write false, without quotes"),
     ("learner: {scoring_prior: 'no'}", "'no' is not valid: write false, without quotes"),
     ("learner: {scoring_prior: 'true'}", "'true' is not valid: write true, without quotes"),
     ("learner: {scoring_prior: 1}", "'1' is not valid: write true, without quotes"),
     ("learner: {scoring_prior: maybe}", "'maybe' is not valid: write true or false"),
     ("learner: {name: qlearning}", "write one of scoring, q-learning, epsilon-greedy, ucb1, thompson, linear-"),
     ("learner: {name: qlearning}", "planner; did you mean 'q-learning'?"),
     ("title: ~", "mine.yaml:2: title: 'None' is not valid: write a word or a text"),
     ("tasks: [grasp cup]", "mine.yaml:2: tasks.0: 'grasp cup' is not an id: 1 to 63 letters, digits, - and _"),
     ("tasks: [grasp cup]", "write for example 'grasp-cup'"),
     ("tasks: grasp", "mine.yaml:2: tasks: 'grasp' is not valid: it is a list; write [grasp]"),
     ("scoring: {strategies: {negation: {levels: [Off, b, c]}}}", "'Off' is not a level or strategy name: 1 to 32"),
     ("scoring: {strategies: {negation: {levels: [Off, b, c]}}}", "write for example 'off'")],
    ids=lambda t: str(t)[:50],
)  # fmt: skip
def test_a_value_of_another_kind_is_refused_with_what_to_write(text: str, says: str) -> None:
    assert says in refusal(text)


def test_json_numbers_are_no_ids_and_the_sentence_says_quotes() -> None:
    with pytest.raises(InvalidStudy) as refused:
        study_of({"study": "x", "tasks": [1, 2]})
    assert refused.value.sentences == (
        """study: tasks.0: '1' is not valid: it is not text; write "1" in quotes""",
        """study: tasks.1: '2' is not valid: it is not text; write "2" in quotes""",
    )


# --- what is not written ---


@pytest.mark.parametrize(
    "text", ["learner:", "conditions:\n  a:\n  b: {}", "scoring:\n  table:\n    gaze:", "conditions:"]
)
def test_a_part_with_nothing_below_it_has_its_defaults(text: str) -> None:
    study = parse_study(f"study: x\n{text}\n")
    assert study.model_copy(update={"conditions": {}}) == Study(study="x")
    assert all(overrides == {} for overrides in study.conditions.values())


@pytest.mark.parametrize(
    ("text", "field"),
    [("tasks:", "tasks"), ("aois:", "aois"), ("title:", "title"), ("interactions:", "interactions"),
     ("aois:\n  -", "aois.0"), ("tasks:\n  - a\n  -", "tasks.1"),
     ("scoring:\n  strategies:\n    negation:", "scoring.strategies.negation"),
     ("conditions:\n  a:\n    reward:", "conditions.a.reward")],
)  # fmt: skip
def test_a_value_with_nothing_written_is_refused(text: str, field: str) -> None:
    assert f": {field}: nothing is written here; write a value, or remove the key" in refusal(text)


def test_null_is_said_where_it_has_a_meaning() -> None:
    assert "null removes it" in refusal("scoring:\n  strategies:\n    hesitation:")
    assert list(parse_study("study: x\nscoring: {strategies: {hesitation: null}}").scoring.strategies) == ["negation"]
    assert parse_study("study: x\ntasks: null").tasks is None


# --- the rest of YAML ---


def test_merge_keys_and_anchors_are_what_they_stand_for() -> None:
    study = parse_study(
        "study: x\nconditions:\n  a: &a {reward: {decay: 0.2}, learner: {name: scoring}}\n"
        "  b: {<<: *a, learner: {epsilon: 0.5}}\n  c: {<<: [{interactions: 5}, *a, {interactions: 6}]}\n"
    )
    assert study.conditions["b"] == {"reward": {"decay": 0.2}, "learner": {"epsilon": 0.5}}
    assert study.conditions["c"] == {"interactions": 5, "reward": {"decay": 0.2}, "learner": {"name": "scoring"}}


def test_a_merge_of_no_mapping_is_refused() -> None:
    assert "<< takes the alias of a mapping" in refusal("reward: {<<: 5}")
    assert "an anchor merges itself" in refusal("reward: &a {<<: *a}")


def test_an_anchor_that_is_used_twice_is_no_warning_of_the_library_s() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert parse_study("study: x\ntasks: [&a b, &a c, *a]\n".replace(", *a", "")).tasks == ["b", "c"]


@pytest.mark.parametrize(
    ("text", "line", "says"),
    [("tasks:\n\t- grasp", 3, "a tab stands where YAML takes spaces only"), ("title: @x", 2, "cannot begin with @"),
     ("title: a: b", 2, "put a value that contains ': ' into quotes"),
     ("title: 'x", 2, "that opens in line 2 is not closed"),
     ("tasks: [a, b", 2, "the bracket that opens in line 2 is not closed; write ]"),
     ("title: *t", 2, "*t names no anchor; write &t at the value"),
     ("reward:\n  decay: 1\n scale: 2", 4, "in one column"),
     ("---\nstudy: y", 2, "--- begins a second study; a file holds one"), ("[]: 1", 2, "a key is a word")],
    ids=lambda t: str(t)[:30],
)  # fmt: skip
def test_a_slip_of_the_pen_is_said_with_its_line(text: str, line: int, says: str) -> None:
    said = refusal(text)
    assert said.startswith(f"mine.yaml:{line}: ")
    assert says in said


def test_a_directive_of_yaml_1_1_changes_no_word() -> None:
    assert parse_study("%YAML 1.1\n---\nstudy: x\ntasks: [no, 010]\n").tasks == ["no", "010"]


@given(json_values)
def test_json_is_read_with_the_lines_of_its_keys(value: Any) -> None:
    text = json.dumps({"study": "x", "zzz": value}, indent="\t")
    try:
        data, lines = read_yaml(text, "x.json")
    except InvalidStudy:
        return
    assert data["study"] == "x"
    assert lines["zzz",] == 3


def test_a_written_study_is_the_study() -> None:
    study = parse_study(
        "study: x\ntitle: 'null'\ntasks: [01, no, 1e5, 'null']\nconditions: {on: {reward: null}, a: {}}\n"
        "scoring: {strategies: {hesitation: null, negation: {}}}\ncapacity: {demanding: [negation]}"
    )
    assert parse_study(write_yaml(study_data(study))) == study
