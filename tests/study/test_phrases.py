"""What the robot says: every text is what the study's table says."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shift_runtime.study_files import find_study
from shift_schemas.errors import InvalidStudy
from shift_study.checks import study_warnings
from shift_study.loading import study_data, study_from_json, study_json, study_of
from support.phrases import GESTURE, NEGATION, THREE, WORDS, mistake, said, study

# --- the built-in studies ---

COFFEE = {
    "coffee": {
        "grasp": ("Take the cup by the handle.", "Do not take the cup by the rim, but by the handle.",
                  "Do not take the cup by the rim."),
        "turn": ("Turn the cup to the right.", "Do not turn the cup to the left, but to the right.",
                 "Do not turn the cup to the left."),
        "pour": ("Pour the water slowly.", "Do not pour the water quickly, but slowly.",
                 "Do not pour the water quickly."),
    },
    "coffee_de": {
        "grasp": ("Nimm die Tasse am Henkel.", "Nimm die Tasse nicht am Rand, sondern am Henkel.",
                  "Nimm die Tasse nicht am Rand."),
        "turn": ("Dreh die Tasse nach rechts.", "Dreh die Tasse nicht nach links, sondern nach rechts.",
                 "Dreh die Tasse nicht nach links."),
        "pour": ("Gieß das Wasser langsam.", "Gieß das Wasser nicht schnell, sondern langsam.",
                 "Gieß das Wasser nicht schnell."),
    },
}  # fmt: skip
PAUSE = {"coffee": "Um, ", "coffee_de": "Ähm, "}


@pytest.mark.parametrize("name", COFFEE)
def test_coffee_says_each_sentence_with_and_without_a_filled_pause(name: str, tmp_path: Path) -> None:
    found = find_study(name, tmp_path)
    assert found is not None
    assert found.study is not None
    assert (found.mistakes, found.warnings) == ((), ())
    for task, sentences in COFFEE[name].items():
        for level, sentence in zip(NEGATION, sentences, strict=True):
            assert said(found.study, task, level, "none") == sentence
            hesitant = PAUSE[name] + sentence[0].lower() + sentence[1:]
            assert said(found.study, task, level, "hesitation") == hesitant


def test_coffee_in_both_languages_differs_in_words_only(tmp_path: Path) -> None:
    both = [find_study(name, tmp_path) for name in COFFEE]
    data = [study_data(found.study) for found in both if found is not None and found.study is not None]
    for each in data:
        for part in ("study", "title", "phrases"):
            del each[part]
    assert data[0] == data[1]


# --- the rule ---


def test_study_without_phrases_has_no_text() -> None:
    without = study_of({"study": "x"})
    assert said(without, "grasp", "affirmation", "none") is None
    assert "phrases" not in study_data(without)
    assert study_warnings(without) == ()


def test_a_task_s_own_sentence_replaces_the_one_for_every_task() -> None:
    own = {"words": WORDS, "sentences": {"affirmation": "hold {it}!"}}
    found = study({"sentences": THREE, "tasks": {"grasp": own, "turn": {"words": WORDS}}})
    assert said(found, "grasp", "affirmation", "none") == "Hold the blue cup!"
    assert said(found, "grasp", "negation", "none") == "Not the red cup."
    assert said(found, "turn", "affirmation", "none") == "Take the blue cup."


def test_a_task_s_own_sentence_counts_before_a_more_precise_one_for_every_task() -> None:
    shared = {**THREE, "affirmation+hesitation": "take, um, {it}."}
    own = {"words": WORDS, "sentences": {"affirmation": "hold {it}!"}}
    found = study({"sentences": shared, "tasks": {"grasp": own, "turn": {"words": WORDS}}})
    assert said(found, "grasp", "affirmation", "hesitation") == "Hold the blue cup!"
    assert said(found, "turn", "affirmation", "hesitation") == "Take, um, the blue cup."


def test_sentence_with_both_levels_needs_no_template() -> None:
    shared = {**THREE, "hesitation + negation": "not, um, {that}."}
    found = study({"sentences": shared, "templates": {"hesitation": {"hesitation": "um, {sentence}"}},
                   "tasks": {"grasp": {"words": WORDS}}})  # fmt: skip
    assert said(found, "grasp", "negation", "hesitation") == "Not, um, the red cup."
    assert said(found, "grasp", "affirmation", "hesitation") == "Um, take the blue cup."


def test_templates_of_several_strategies_are_put_around_in_their_order() -> None:
    templates = {"gesture": {"pointing": "{sentence} Look at {task}."}, "hesitation": {"hesitation": "um, {sentence}"}}
    found = study({"sentences": THREE, "templates": templates, "tasks": {"grasp": {"words": WORDS}}}, scoring=GESTURE)
    assert said(found, "grasp", "negation", "hesitation", "pointing") == "Um, not the red cup. Look at grasp."
    assert said(found, "grasp", "negation", "none", "pointing") == "Not the red cup. Look at grasp."


def test_level_that_two_strategies_have_is_named_with_its_strategy() -> None:
    found = study({"sentences": {"gesture.none": "go.", "gesture.pointing": "there."}}, scoring=GESTURE)
    assert said(found, "grasp", "negation", "none", "none") == "Go."
    assert said(found, "grasp", "negation", "none", "pointing") == "There."
    detail = mistake({"sentences": {"none": "go."}}, scoring=GESTURE)
    assert "several strategies have the level 'none'; write hesitation.none or gesture.none" in detail


def test_first_letter_is_a_capital_and_white_space_is_single_spaces() -> None:
    found = study({"sentences": {"affirmation": " über  {it}\n jetzt "}, "tasks": {"grasp": {"words": {"it": ""}}}})
    assert said(found, "grasp", "affirmation", "none") == "Über jetzt"


def test_words_with_variables_of_other_words_are_not_filled_again() -> None:
    assert "a word cannot have braces" in mistake({"tasks": {"grasp": {"words": {"it": "{that}"}}}})


@given(st.dictionaries(st.sampled_from(NEGATION), st.text("ab {}", min_size=1), min_size=1))
def test_any_sentence_is_said_or_refused_with_a_rule(sentences: dict[str, str]) -> None:
    try:
        found = study({"sentences": sentences})
    except InvalidStudy as e:
        assert e.errors  # noqa: PT017
        return
    for level, hesitation in product(NEGATION, ("none", "hesitation")):
        text = " ".join(sentences[level].split()) if level in sentences else None
        if text is not None and "{" not in text:
            assert said(found, "grasp", level, hesitation) == text[0].upper() + text[1:]


def test_phrases_pass_through_a_configuration_unchanged() -> None:
    found = study({"sentences": THREE, "templates": {"hesitation": {"hesitation": "äh, {sentence}"}},
                   "tasks": {"grasp": {"words": WORDS}}})  # fmt: skip
    assert study_from_json(study_json(found)) == found
