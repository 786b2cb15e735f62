"""What is doubtful in a study that follows every rule: said with the value and what it means."""

from __future__ import annotations

from typing import Any

import pytest
from shift_model.vocabulary import LearnerName
from shift_schemas.errors import InvalidStudy
from shift_study.area_checks import area_mistakes
from shift_study.checks import PLAUSIBLE, study_warnings
from shift_study.learner_settings import LEARNER_SETTINGS, LearnerSettings, parameters_of
from shift_study.loading import parse_study, study_data, study_of
from shift_study.study import Study


def warned(**parts: Any) -> tuple[str, ...]:
    """The warnings of a study with these parts."""
    return study_warnings(study_of({"study": "x", **parts}))


def refusal(text: str) -> str:
    """What is said of a study file."""
    with pytest.raises(InvalidStudy) as refused:
        parse_study(f"study: x\n{text}")
    return refused.value.detail


def test_the_defaults_and_the_paper_s_values_are_beyond_doubt() -> None:
    assert study_warnings(Study(study="x")) == ()
    assert area_mistakes(Study(study="x").aois) == ()


@pytest.mark.parametrize(
    ("part", "key", "value", "says"),
    [("fixation", "distance_cm", 650, "is plausible from 20 to 300; if 650 mm are meant, write 65"),
     ("fixation", "distance_cm", 0.65, "fixation.distance_cm is 0.65: the distance"),
     ("fixation", "screen_width_cm", 509, "if 509 mm are meant, write 50.9"),
     ("fixation", "screen_height_cm", 286, "if 286 mm are meant, write 28.6"),
     ("fixation", "minimum_duration_s", 60, "if 60 ms are meant, write 0.06"),
     ("fixation", "median_filter_s", 30, "if 30 ms are meant, write 0.03"),
     ("fixation", "maximum_gap_s", 75, "if 75 ms are meant, write 0.075"),
     ("fixation", "dispersion_deg", 50, "the extent of a fixation in degrees is plausible from 0.1 to 10"),
     ("attention", "step_s", 100, "if 100 ms are meant, write 0.1"),
     ("attention", "maximum_dwell_s", 1000, "if 1000 ms are meant, write 1"),
     ("decider", "wait_s", 300, "if 300 ms are meant, write 0.3"),
     ("reward", "decay", 100, "the decay of the reward per second is plausible from 0 to 10")],
)  # fmt: skip
def test_a_value_of_another_unit_is_warned_about(part: str, key: str, value: float, says: str) -> None:
    found = warned(**{part: {key: value}})
    assert len(found) == 1
    assert found[0].startswith(f"{part}.{key} is {value:g}: ")
    assert says in found[0]


def test_every_plausible_range_holds_the_default() -> None:
    for path, expected in PLAUSIBLE.items():
        part, key = path.split(".")
        assert expected.low <= getattr(getattr(Study(study="x"), part), key) <= expected.high


def test_entries_of_the_table_that_are_neither_0_nor_1_are_warned_about() -> None:
    table = {"gaze": {"focused": {"negation": 0.5}}, "capacity": {"low": {"hesitation": 0.25}}}
    (sentence,) = warned(scoring={"table": table})
    assert sentence.startswith("scoring.table: capacity.low.hesitation is 0.25, gaze.focused.negation is 0.5; ")
    assert sentence.endswith(
        "has 0 or 1 for each category and strategy, and an entry between them counts as that share"
    )


def test_a_level_that_no_score_reaches_is_warned_about() -> None:
    (sentence,) = warned(scoring={"strategies": {"hesitation": {"thresholds": [50]}}})
    assert sentence.startswith("scoring.strategies.hesitation: the scoring system never suggests hesitation, ")
    assert sentence.endswith("since its threshold is 50 and the largest score is 1")


def test_what_a_condition_changes_is_warned_about_under_its_name() -> None:
    found = warned(conditions={"near": {}, "far": {"fixation": {"distance_cm": 650}}})
    assert [sentence[:45] for sentence in found] == ["condition far: fixation.distance_cm is 650: th"[:45]]


def test_a_doubt_of_the_whole_study_is_said_once() -> None:
    assert len(warned(fixation={"distance_cm": 650}, conditions={"a": {}, "b": {}})) == 1


# --- parameters without effect ---


def test_a_parameter_that_the_learner_does_not_read_is_warned_about() -> None:
    assert warned(learner={"name": "scoring", "epsilon": 0.75, "noise": 1.0}) == (
        "learner.epsilon has no effect: scoring does not read it; it is a parameter of q-learning, epsilon-greedy",
        "learner.noise has no effect: scoring does not read it; it is a parameter of linear-thompson",
    )
    assert warned(learner={"name": "epsilon-greedy", "epsilon": 0.75}) == ()


def test_with_every_default_written_out_only_what_differs_is_warned_about() -> None:
    study = study_of(study_data(study_of({"study": "x", "learner": {"name": "thompson", "epsilon": 0.5}})))
    assert len(study_warnings(study)) == 1
    assert study_warnings(study_of(study_data(study_of({"study": "x", "learner": {"name": "thompson"}})))) == ()


def test_a_parameter_that_one_condition_s_learner_reads_has_an_effect() -> None:
    conditions: dict[str, Any] = {"control": {"learner": {"name": "scoring"}}, "adaptive": {}}
    assert warned(learner={"epsilon": 0.5}, conditions=conditions) == ()
    conditions["control"]["learner"]["epsilon"] = 0.1
    (sentence,) = warned(conditions=conditions)
    assert sentence.startswith("conditions.control.learner.epsilon has no effect: scoring does not read it")


def test_every_parameter_belongs_to_a_learner() -> None:
    assert set(LEARNER_SETTINGS) <= set(LearnerName.__args__), "a learner without parameters needs no entry"
    assert frozenset().union(*(parameters_of(name) for name in LEARNER_SETTINGS)) == set(
        LearnerSettings.model_fields
    ) - {"name", "paused"}


# --- units, cells and shapes in what is refused ---


@pytest.mark.parametrize(
    ("text", "says"),
    [("fixation: {distance_mm: 650}", "'distance_mm' is not a key here; write 'distance_cm', in cm: 650 mm are 65 cm"),
     ("fixation: {distance_m: 0.65}", "write 'distance_cm', in cm: 0.65 m are 65 cm"),
     ("fixation: {screen_width_px: 1920}", "'screen_width_cm', in cm: pixels cannot be converted, so measure it in cm"),
     ("fixation: {minimum_duration_ms: 60}", "write 'minimum_duration_s', in s: 60 ms are 0.06 s"),
     ("fixation: {dispersion_rad: 0.1}", "write 'dispersion_deg', in degrees: 0.1 rad are 5.72958 degrees"),
     ("fixation: {dispersion_px: 50}", "write 'dispersion_deg', in degrees: pixels cannot be converted"),
     ("fixation: {dispersion_cm: 2}", "write 'dispersion_deg', in degrees: cm cannot be converted"),
     ("fixation: {distance: 65}", "write 'distance_cm', in cm"), ("attention: {step_ms: 100}", "100 ms are 0.1 s"),
     ("decider: {wait_min: 1}", "write 'wait_s', in s: 1 minutes are 60 s"),
     ("decider: {wait_ms: much}", "write 'wait_s', in s: convert the value from ms")],
)  # fmt: skip
def test_a_key_of_another_unit_is_refused_with_what_its_value_would_be(text: str, says: str) -> None:
    assert says in refusal(text)


CELLS = """study: x
scoring:
  strategies:
    gesture: {levels: [still, pointing], thresholds: [0.5]}
  table:
    capacity: {low: {gesture: 1}, high: {gesture: 0}}
    gaze: {distracted: {gesture: 1}, uncertain: {gesture: 1}, focused: {gesture: 0}}
    awareness:
      unknown: {gesture: 0}
      failure: {gestur: 1}
      misconception_enabledness: {gesture: 0}
      success: {gesture: 0}
"""


def test_a_missing_cell_of_the_table_is_reported_at_its_path_and_line() -> None:
    with pytest.raises(InvalidStudy) as refused:
        parse_study(CELLS, "mine.yaml")
    path, names = "scoring.table.awareness", "one of negation, hesitation, gesture"
    assert refused.value.sentences == (
        f"mine.yaml:8: {path}.misconception_comprehension.gesture: it is missing; write 0 or 1 for gesture",
        f"mine.yaml:10: {path}.failure.gesture: it is missing; write 0 or 1 for gesture",
        f"mine.yaml:10: {path}.failure.gestur: 'gestur' is not a strategy; write {names}; did you mean 'gesture'?",
    )
    assert [(e.field, e.value) for e in refused.value.errors][1:] == [
        (f"{path}.failure.gesture", ""), (f"{path}.failure.gestur", "gestur"),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("aois", "says"),
    [("[{name: cup, rectangle: [0, 0, 50, 100]}]", "width: 50 % is written 0.5, 50 pixels are 50 divided by"),
     ("[{name: cup, rectangle: [0, 0, 960, 1]}]", "960 pixels are 960 divided by the stimulus' width in pixels"),
     ("[{name: cup, polygon: [[0, 540], [1, 0], [1, 1]]}]", "540 pixels are 540 divided by the stimulus' height"),
     ("[{name: cup, rectangle: [0,1, 0,9]}]", "0,9 is written 0.9"),
     ("[{name: cup, rectangle: [0,0, 0,5, 1]}]", "it has 5 entries and needs 4: left, top, right, bottom; write"),
     ("[{name: cup, polygon: [[0,5, 0,5], [1, 0], [1, 1]]}]", "it has 4 entries and needs 2: x, y; write decimals"),
     ("[{name: cup, rectangle: [0.6, 0.1, 0.3, 0.5]}]", "top, width, height are meant, write [0.6, 0.1, 0.9, 0.6]"),
     ("[robot]", "an area has a name and a shape; write {name: robot, rectangle: [left, top, right, bottom]}"),
     ("{robot: [0, 0, 1, 1]}", "it is a list; write - {name: robot, rectangle: [left, top, right, bottom]}"),
     ("[]", "it has 0 entries and needs at least 1; write more, or remove the key"),
     ("[{name: a, rectangle: [0, 0, 1, 1]}, {name: a, rectangle: [0, 0, 1, 1]}]", "must differ; a is there twice")],
)  # fmt: skip
def test_an_area_in_another_unit_or_form_is_refused_with_the_one_to_write(aois: str, says: str) -> None:
    assert says in refusal(f"aois: {aois}")


def test_mistakes_of_every_condition_are_said_with_its_name() -> None:
    said = refusal("conditions:\n  a: {learner: {nmae: scoring}}\n  b: {learner: {epsilon: 2}}")
    assert "study:3: conditions.a.learner.nmae: 'nmae' is not a key here; write 'name'" in said
    assert "study:4: conditions.b.learner.epsilon: '2' is not valid" in said
