"""The capacity equation on a lattice, compared with the equation itself."""

from __future__ import annotations

import numpy as np
import pytest
from shift_learner.learners.planning.capacity_model import MOST_LEVELS, capacity_model_of
from shift_study.study import Study

STUDY = Study(study="s")


def test_capacity_model_has_the_values_that_capacity_can_take() -> None:
    model = capacity_model_of(STUDY)
    assert model.values.tolist() == pytest.approx([i / 10 for i in range(11)])
    assert model.repeated.tolist() == [3, 4, 5, 6, 7, 8, 9, 10, 10, 10, 10]
    assert model.executed[2].tolist() == [0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8]


def test_many_reachable_values_are_replaced_by_a_grid() -> None:
    fine = Study.model_validate({"study": "s", "capacity": {"recovery": 0.07, "demanding_cost": 0.013}})
    model = capacity_model_of(fine)
    assert model.values.tolist() == np.linspace(0.0, 1.0, MOST_LEVELS).tolist()
    assert model.values[model.repeated[0]] == pytest.approx(0.05), "the grid value nearest to 0.07"


def test_level_is_the_nearest_value_of_the_observed_class() -> None:
    model = capacity_model_of(STUDY)
    level = model.level_of(np.array([0.42, 0.42]), np.array([0, 1]))
    assert model.values[level].tolist() == pytest.approx([0.4, 0.5])


def test_capacity_after_an_action_follows_the_equation() -> None:
    model = capacity_model_of(STUDY)
    after = model.settings.after(np.array([0.5, 0.5]), np.array([True, False]), np.array([0.2, 0.2]))
    assert after.tolist() == pytest.approx([0.8, 0.3])
