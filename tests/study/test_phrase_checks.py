"""Phrases with mistakes are refused, and what the robot cannot say is said when the study is read."""

from __future__ import annotations

from typing import Any

import pytest
from shift_schemas.errors import InvalidStudy
from shift_study.checks import study_warnings
from shift_study.loading import parse_study
from support.phrases import NEGATION, THREE, WORDS, mistake, said, study


@pytest.mark.parametrize(
    ("phrases", "says"),
    [({"sentences": {"affirmaton": "go."}}, "'affirmaton' is not a level"),
     ({"sentences": {"hesitation.negation": "go."}}, "strategy 'hesitation' with level 'negation' is not in the study"),
     ({"sentences": {"affirmation+negation": "go."}}, "it has two levels of one strategy"),
     ({"sentences": {"affirmation": "go.", "none": "run."}}, "has 2 sentences for affirmation + none"),
     ({"sentences": {"affirmation": "go {}."}}, "braces hold the name of a word"),
     ({"sentences": {"affirmation": "go {Cup}."}}, "braces hold the name of a word"),
     ({"sentences": {"affirmation": " "}}, "it is empty"),
     ({"sentences": {"affirmation": "go\x00."}}, "control character U+0000"),
     ({"templates": {"hesitation": {"hesitation": "um"}}}, "a template has {sentence} once"),
     ({"templates": {"hesitation": {"um": "um, {sentence}"}}}, "phrases.templates.hesitation.um is not a level"),
     ({"templates": {"pause": {"um": "um, {sentence}"}}}, "phrases.templates.pause is not a strategy"),
     ({"tasks": {"grab": {}}}, "phrases.tasks.grab is not a task of the study; it has grasp, turn"),
     ({"tasks": {"grasp": {"words": {"sentence": "x"}}}}, "give the word another name"),
     ({"sentence": {}}, "write 'sentences'")],
)  # fmt: skip
def test_mistake_is_refused_with_what_to_write(phrases: Any, says: str) -> None:
    assert says in mistake(phrases)


def test_mistake_names_file_and_line() -> None:
    text = (
        "study: x\nphrases:\n  sentences:\n    affirmation: go.\n  templates:\n    hesitation: {um: 'um, {sentence}'}\n"
    )
    with pytest.raises(InvalidStudy) as refused:
        parse_study(text, "x.yaml")
    assert refused.value.detail.startswith("x.yaml:6: ")


# --- warnings ---


def test_missing_sentences_are_warned_about_once_for_all_tasks() -> None:
    (warning,) = study_warnings(study({"sentences": {"affirmation": "go.", "negation": "stop."}}))
    assert warning == (
        "phrases: grasp, turn: there is no sentence for negation_affirmation + none, "
        "negation_affirmation + hesitation; the robot then says nothing"
    )


def test_missing_word_is_warned_about_and_the_robot_is_silent() -> None:
    found = study({"sentences": THREE, "tasks": {"grasp": {"words": WORDS}, "turn": {"words": {"it": "the cup"}}}})
    (warning,) = study_warnings(found)
    assert warning.startswith("phrases: turn: there is no word {that}, which the sentence for negation_affirmation + ")
    assert said(found, "turn", "negation", "none") is None
    assert said(found, "turn", "affirmation", "none") == "Take the cup."


def test_task_that_is_not_listed_is_warned_about_where_any_id_is_a_task() -> None:
    found = study({"sentences": THREE, "tasks": {"grasp": {"words": WORDS}}}, tasks=None)
    assert all("any task that phrases.tasks does not name" in w for w in study_warnings(found))
    assert study_warnings(study({"sentences": dict.fromkeys(NEGATION, "{task}.")}, tasks=None)) == ()


def test_condition_can_change_what_is_said() -> None:
    formal = {"phrases": {"sentences": {"affirmation": "please go."}}}
    found = study({"sentences": dict.fromkeys(NEGATION, "go.")}, conditions={"formal": formal, "empty": {}})
    assert study_warnings(found) == ()
    silent = study({"sentences": dict.fromkeys(NEGATION, "go.")},
                   conditions={"silent": {"phrases": {"sentences": {"negation": None}}}})  # fmt: skip
    (warning,) = study_warnings(silent)
    assert warning.startswith("condition silent: phrases: grasp, turn: there is no sentence for negation + none")
