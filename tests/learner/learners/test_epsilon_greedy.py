"""Epsilon-greedy, compared with the mean and the decay written out."""

from __future__ import annotations

import numpy as np
import pytest
from shift_learner.learners import LEARNERS
from support.learner_histories import after_history, context


def test_epsilon_greedy_value_is_the_mean_with_the_prior_as_one_result() -> None:
    where, learner = context("epsilon-greedy", epsilon=0.6), LEARNERS["epsilon-greedy"]
    memory, seen = after_history(learner, where, 50)
    for triple in range(30):
        row = learner.row(where, memory, triple)
        for action in range(6):
            rewards = [r for t, a, r in seen if (t, a) == (triple, action)]
            first = 1.0 if action == where.suggestions[triple] else 0.0
            assert row.values[action] == pytest.approx(np.mean([first, *rewards]))
            best = row.values.index(max(row.values)) == action
            assert row.probabilities[action] == pytest.approx(0.6 * 0.5 / 6 + (1 - 0.6 * 0.5) * best)
