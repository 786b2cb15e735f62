"""The planner's look-ahead, compared with a plain recursion."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from shift_learner.learners.planning.capacity_model import capacity_model_of
from shift_learner.learners.planning.lookahead import SAME_TASK, outcome_values
from shift_study.study import Study

STUDY = Study(study="s")
RNG = np.random.default_rng(4)


def naive_values(
    chance: np.ndarray, transitions: np.ndarray, share: float, depth: int, discount: float
) -> dict[object, float]:
    """Return the value of each state (capacity, previous, gaze, awareness: 0 failure, 1 success), by recursion."""
    model = capacity_model_of(STUDY)
    awareness = (1, 4)

    def expected(level: int, action: int, gaze: int, outcome: int, left: int) -> float:
        if left == 0:
            return 0.0
        total = 0.0
        for g, w in product(range(3), range(2)):
            p_w = SAME_TASK * (w == outcome) + (1 - SAME_TASK) * (share if w else 1 - share)
            total += transitions[gaze, g] * p_w * value(level, action, g, w, left)
        return total

    def value(level: int, previous: int, gaze: int, w: int, left: int) -> float:
        best = -np.inf
        for a in range(6):
            after = model.repeated[level] if a == previous else model.executed[a, level]
            p = chance[a, model.high[level], gaze, awareness[w]]
            won = 1 + discount * expected(after, a, gaze, 1, left - 1)
            lost = -1 + discount * expected(after, a, gaze, 0, left - 1)
            best = max(best, p * won + (1 - p) * lost)
        return best

    cells = product((0, 4, 10), (0, 5), range(3), range(2))
    return {cell: expected(*cell, depth) for cell in cells}


def test_look_ahead_matches_the_expectation_by_recursion() -> None:
    chance = RNG.random((6, 2, 3, 5))
    transitions = RNG.dirichlet(np.ones(3), 3)
    found = outcome_values(capacity_model_of(STUDY), chance[..., None], transitions[..., None], np.array([0.3]), 2, 0.9)
    for (level, action, gaze, outcome), value in naive_values(chance, transitions, 0.3, 2, 0.9).items():
        assert found[action, level, gaze, outcome, 0] == pytest.approx(value)
