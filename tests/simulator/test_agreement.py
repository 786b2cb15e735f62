"""The vectorised simulation and the services' cores agree step by step for the same session seed."""

from __future__ import annotations

import numpy as np
import pytest
from shift_model.random_numbers import uniform
from shift_simulator.random_streams import SESSION, session_seed, session_seeds
from shift_simulator.users import User, paper_user
from shift_study.study import Study
from support.agreement import check_agreement


@pytest.mark.parametrize("name", ["A", "B", "C", "D"])
@pytest.mark.parametrize("learner", [{}, {"scoring_prior": False}, {"name": "scoring"}])
def test_batched_simulation_agrees_with_the_cores(name: str, learner: dict[str, object]) -> None:
    study = Study.model_validate({"study": "s", "learner": learner})
    check_agreement(paper_user(name), study, runs=2)


def test_person_with_changes_and_own_capacity_agrees() -> None:
    user = paper_user("B").model_dump()
    change = {"at": 20, "success": np.random.default_rng(1).random((30, 6)).tolist()}
    own = {"capacity": {"recovery": 0.1, "threshold": 0.4}, "changes": [change], "gaze": {"keep": 0.8}, "tasks": 5}
    check_agreement(User.model_validate(user | own), Study(study="s"), runs=3)


def test_session_seeds_are_counter_based_and_fit_into_a_double() -> None:
    seeds = session_seeds(7, 50)
    assert seeds.tolist() == [session_seed(7, run) for run in range(50)]
    assert seeds.tolist() == [int(uniform(7, run, SESSION) * 2**53) for run in range(50)]
    assert len(set(seeds.tolist())) == 50
    assert seeds.max() < 2**53


@pytest.mark.parametrize("learner", ["epsilon-greedy", "ucb1", "thompson", "linear-thompson"])
def test_every_other_learner_agrees(learner: str) -> None:
    check_agreement(paper_user("C"), Study.model_validate({"study": "s", "learner": {"name": learner}}), 1, 25)
