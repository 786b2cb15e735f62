"""The planner makes the same decisions in the cores, one event at a time, as in its batched form."""

from __future__ import annotations

from shift_simulator.users import User, paper_user
from shift_study.study import Study
from support.agreement import check_agreement

PLANNER = Study.model_validate({"study": "s", "learner": {"name": "planner"}})


def test_batched_planner_agrees_with_the_live_learner() -> None:
    check_agreement(paper_user("B"), PLANNER, runs=2, episodes=100)


def test_batched_planner_agrees_for_a_person_with_changes_and_own_capacity() -> None:
    user = paper_user("D").model_dump() | {
        "capacity": {"recovery": 0.1},
        "changes": [{"at": 10, "success": paper_user("A").success}],
    }
    check_agreement(User.model_validate(user), PLANNER, runs=2, episodes=40)
