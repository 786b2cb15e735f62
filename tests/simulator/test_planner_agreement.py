"""The planner live, one event at a time through the cores, takes the decisions that its batched form takes."""

from __future__ import annotations

from shift_simulator.users import User, paper_user
from shift_study.study import Study
from support.agreement import check_agreement

PLANNER = Study.model_validate({"study": "s", "learner": {"name": "planner"}})


def test_planning_for_many_runs_at_once_takes_the_decisions_of_the_live_learner() -> None:
    check_agreement(paper_user("B"), PLANNER, runs=2, episodes=100)


def test_also_where_the_person_changes_and_its_true_capacity_differs() -> None:
    user = paper_user("D").model_dump() | {
        "capacity": {"recovery": 0.1},
        "changes": [{"at": 10, "success": paper_user("A").success}],
    }
    check_agreement(User.model_validate(user), PLANNER, runs=2, episodes=40)
