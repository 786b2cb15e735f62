"""Simulated users: the paper's four users, user files and their mistakes."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from shift_model.vocabulary import TRIPLES
from shift_schemas.errors import InvalidSettings
from shift_simulator.simulated_person import create_person, task_names
from shift_simulator.users import User, paper_user, parse_user, true_capacity
from shift_study.scoring import reduce
from shift_study.scoring_table import ScoringSettings
from shift_study.study import Study

SCORING = ScoringSettings.model_validate({})
STUDY = Study(study="s")


def text(**changes: Any) -> str:
    return json.dumps({"user": "x", "success": [[0.5] * 6] * 30} | changes)


@pytest.mark.parametrize("name", ["A", "B", "C", "D"])
def test_papers_users_follow_their_description(name: str) -> None:
    table = np.array(paper_user(name).success)
    for t, triple in enumerate(TRIPLES):
        for a, (negation, _) in enumerate(SCORING.actions):
            right = reduce(SCORING, triple).action == a
            if name != "A" and negation != "affirmation":
                right = triple.capacity == "low"
                if name in "CD" and triple.awareness in ("misconception_enabledness", "success"):
                    right = False
                if name == "D" and triple.gaze in ("distracted", "uncertain"):
                    right = False
            assert table[t, a] == right


def test_user_file_needs_only_a_name_and_a_table() -> None:
    user = parse_user(text())
    assert (user.tasks, user.gaze.keep, user.changes) == (3, 0.3, [])
    assert true_capacity(user, STUDY) == STUDY.capacity


def test_change_takes_effect_after_the_given_interactions() -> None:
    user = parse_user(text(changes=[{"at": 50, "success": [[1] * 6] * 30}]))
    assert user.table_at(50)[0, 0] == 0.5
    assert user.table_at(51)[0, 0] == 1.0


@pytest.mark.parametrize(
    ("mistake", "message"),
    [
        (text(success=[[2.0] * 6] * 30), "success.0.0 is 2.0: Input should be less than or equal to 1"),
        (text(success=[[0.5] * 5] * 30), "at least 6 items"),
        (text(success=[[0.5] * 6] * 29), "at least 30 items"),
        (text(tasks=0), "tasks is 0: Input should be greater than or equal to 1"),
        (text(keep=0.3), "keep is 0.3: Extra inputs are not permitted"),
        (text(gaze={"keep": "x"}), "gaze.keep is x"),
        (text(capacity={"recover": 1}), "capacity.recover is 1: Extra inputs"),
        (text(changes=[{"at": 9, "success": [[1] * 6] * 30}] * 2), "changes must be in rising order of at"),
        ('{"user": "x", "user": "y"}', "'user' is given twice"),
        ('{"user": NaN}', "NaN is not a number in JSON"),
        ("[1", "this is not a user file in JSON"),
        ("[" * 100_000, "this is not a user file in JSON"),
        ('{"user": "x"}', "success is missing"),
    ],
)
def test_mistake_in_a_user_file_is_refused_with_place_value_and_rule(mistake: str, message: str) -> None:
    with pytest.raises(InvalidSettings, match=r"^me\.json: ") as e:
        parse_user(mistake, "me.json")
    assert message in e.value.detail


def test_true_capacity_that_contradicts_the_study_is_refused() -> None:
    user = parse_user(text(capacity={"start": 3.0}))
    with pytest.raises(InvalidSettings, match="min <= start <= max"):
        true_capacity(user, STUDY)


def test_unknown_built_in_user_is_refused_with_the_known_names() -> None:
    with pytest.raises(InvalidSettings, match="no built-in user 'E'; write one of A, B, C, D"):
        paper_user("E")


def test_too_few_tasks_in_the_study_are_refused() -> None:
    user = User.model_validate(json.loads(text()))
    assert task_names(user, STUDY) == ["task-1", "task-2", "task-3"]
    assert task_names(user, Study(study="s", tasks=["a", "b", "c", "d"])) == ["a", "b", "c"]
    with pytest.raises(InvalidSettings, match="has 3 tasks; study s has 1"):
        task_names(user, Study(study="s", tasks=["a"]))


def test_fair_coin_decides_one_outcome_in_twenty() -> None:
    right = TRIPLES[29]
    action = reduce(SCORING, right).action
    outcomes = [create_person(paper_user("A"), STUDY, seed).perform(1, right, action) for seed in range(4000)]
    assert np.mean([o.success for o in outcomes]) == pytest.approx(0.975, abs=0.01)
    assert {o.comprehension_s for o in outcomes} == {4.0, 5.0, 6.0, 7.0, 8.0}
