"""A learner's prior from a table: in the study, or in a file beside it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from shift_runtime.study_files import check_file
from shift_schemas.errors import InvalidStudy
from shift_study.checks import study_warnings
from shift_study.loading import given_study, study_data

SHARES = {"unfocused": {"negation + none": 0.75, "affirmation + hesitation": 0.25}}


def write(folder: Path, study: str, table: object) -> Path:
    (folder / "wizard.json").write_text(json.dumps(table))
    path = folder / "mine.yaml"
    path.write_text(study)
    return path


def test_table_of_the_file_takes_the_place_of_its_name(tmp_path: Path) -> None:
    study = "study: mine\nlearner: {prior: wizard.json}\nconditions: {b: {learner: {prior: wizard.json}}}\n"
    found = check_file(write(tmp_path, study, {"format": 1, "states": SHARES}), "mine.yaml")
    assert found.mistakes == ()
    assert found.study is not None
    assert found.study.learner.prior == SHARES
    assert study_data(found.study)["conditions"]["b"]["learner"]["prior"] == SHARES


@pytest.mark.parametrize(
    ("name", "table", "said"),
    [
        ("nowhere.json", {}, "No such file"),
        ("../wizard.json", {}, "without a path"),
        ("wizard.json", {"format": 2, "states": SHARES}, "not a policy table of format 1"),
        ("wizard.json", [1], "not a policy table"),
    ],
)
def test_file_that_cannot_be_used_is_a_mistake_with_its_line(
    name: str, table: object, said: str, tmp_path: Path
) -> None:
    found = check_file(write(tmp_path, f"study: mine\nlearner:\n  prior: {name}\n", table), "mine.yaml")
    (sentence,) = found.mistakes
    assert sentence.startswith("mine.yaml:3: learner.prior: the prior file")
    assert said in sentence


@pytest.mark.parametrize(
    ("prior", "said"),
    [
        ({"focused": {"negation + none": 1.0}}, "the state 'focused'; the study has"),
        ({"unfocused": {"negation": 1.0}}, "the strategy 'negation'; the study has affirmation + none"),
        ({"unfocused": {"negation + none": 2.0}}, "1"),
        ("wizard.json", "prior"),
    ],
)
def test_wrong_table_is_refused(prior: object, said: str) -> None:
    with pytest.raises(InvalidStudy, match=r"learner\.prior") as e:
        given_study({"study": "x", "learner": {"prior": prior}})
    assert said in str(e.value)


@pytest.mark.parametrize(("learner", "reads"), [("q-learning", True), ("thompson", True), ("planner", False)])
def test_learner_that_does_not_read_the_table_is_named(learner: str, reads: bool) -> None:
    warnings = study_warnings(given_study({"study": "x", "learner": {"name": learner, "prior": SHARES}}))
    assert any("learner.prior has no effect" in warning for warning in warnings) is not reads
