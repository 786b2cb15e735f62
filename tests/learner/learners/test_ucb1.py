"""UCB1, compared with the bound of Auer et al. written out."""

from __future__ import annotations

from math import log, sqrt

import numpy as np
import pytest
from shift_learner.learners import LEARNERS
from support.learner_histories import after_history, context


def test_ucb1_value_is_the_bound_of_auer_on_rewards_between_0_and_1() -> None:
    where, learner = context("ucb1", exploration=0.7), LEARNERS["ucb1"]
    memory, seen = after_history(learner, where, 300)
    for triple in range(30):
        row = learner.row(where, memory, triple)
        here = [(a, r) for t, a, r in seen if t == triple]
        for action in range(6):
            rewards = [(r + 1) / 2 for a, r in here if a == action]
            if rewards:
                bound = np.mean(rewards) + 0.7 * sqrt(2 * log(len(here)) / len(rewards))
                assert row.values[action] == pytest.approx(bound)
        assert row.probabilities[row.values.index(max(row.values))] == 1.0
