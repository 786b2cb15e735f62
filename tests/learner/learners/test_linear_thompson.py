"""Linear Thompson sampling, compared with sampling and with ridge regression."""

from __future__ import annotations

from math import sqrt

import numpy as np
import pytest
from shift_learner.learners import LEARNERS, linear_thompson
from support.learner_histories import after_history, context


def test_normal_chances_match_frequencies_of_sampling() -> None:
    means, deviations = (0.0, 0.1, 0.4, -1.0), (1.0, 0.2, 0.05, 2.0)
    samples = np.random.default_rng(1).normal(means, deviations, (400_000, 4))
    frequencies = np.bincount(samples.argmax(axis=1), minlength=4) / len(samples)
    assert linear_thompson.chances(means, deviations) == pytest.approx(frequencies.tolist(), abs=0.004)


def test_linear_thompson_matches_ridge_regression() -> None:
    where, learner = context("linear-thompson", noise=0.3, prior_strength=2.0), LEARNERS["linear-thompson"]
    memory, seen = after_history(learner, where, 80)
    prior = np.zeros(11)
    prior[-1] = 1.0
    for action in range(6):
        x = np.array([linear_thompson.features(where, t)[action] for t, a, _ in seen if a == action])
        y = np.array([r for _, a, r in seen if a == action])
        covariance = np.linalg.inv(x.T @ x / 0.09 + 2 * np.eye(11))
        weights = covariance @ (x.T @ y / 0.09 + 2 * prior)
        for triple in range(30):
            means, deviations = linear_thompson.posterior(where, memory, triple)
            here = linear_thompson.features(where, triple)[action]
            assert means[action] == pytest.approx(here @ weights)
            assert deviations[action] == pytest.approx(sqrt(here @ covariance @ here))
