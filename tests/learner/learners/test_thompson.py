"""Thompson sampling with Beta posteriors, compared with closed forms, sampling and plain counts."""

from __future__ import annotations

import numpy as np
import pytest
from shift_learner.learners import LEARNERS, thompson
from support.learner_histories import after_history, context


def test_chances_of_two_beta_arms_match_the_closed_form() -> None:
    """P(X > Y) for X ~ Beta(2, 1) and Y ~ Beta(1, 1) is the mean of X, 2/3."""
    assert thompson.chances((2.0, 1.0), (1.0, 1.0)) == pytest.approx([2 / 3, 1 / 3], abs=1e-6)
    assert thompson.chances((1.0,) * 6, (1.0,) * 6) == pytest.approx([1 / 6] * 6, abs=1e-9)


def test_beta_chances_match_frequencies_of_sampling() -> None:
    a, b = (3.0, 1.0, 5.5, 2.0, 40.0, 1.0), (2.0, 1.0, 4.0, 9.0, 31.0, 6.0)
    samples = np.random.default_rng(1).beta(a, b, (400_000, 6))
    frequencies = np.bincount(samples.argmax(axis=1), minlength=6) / len(samples)
    assert thompson.chances(a, b) == pytest.approx(frequencies.tolist(), abs=0.004)


def test_finer_grid_changes_beta_chances_by_less_than_the_stated_error(monkeypatch: pytest.MonkeyPatch) -> None:
    a, b = (90.0, 80.0, 5.0, 1.0, 1.0, 2.5), (12.0, 12.0, 1.0, 5.0, 1.0, 3.0)
    coarse = thompson.chances(a, b)
    monkeypatch.setattr(thompson, "POINTS", 16 * 1024 + 1)
    thompson.chances.cache_clear()
    assert coarse == pytest.approx(thompson.chances(a, b), abs=5e-5)
    thompson.chances.cache_clear()


@pytest.mark.parametrize("states", ["cognitive", "triples"])
def test_beta_posteriors_count_per_state_or_per_triple(states: str) -> None:
    where, learner = context("thompson", thompson_states=states, prior_strength=2.0), LEARNERS["thompson"]
    memory, seen = after_history(learner, where, 80)
    for triple in range(30):
        row = learner.row(where, memory, triple)
        for action in range(6):
            here = [
                r
                for t, a, r in seen
                if a == action
                and (t == triple if states == "triples" else where.suggestions[t] == where.suggestions[triple])
            ]
            suggested = action == where.suggestions[triple]
            a = 1 + sum(r > 0 for r in here) + 2 * suggested
            b = 1 + sum(r < 0 for r in here) + 2 * (not suggested)
            assert row.values[action] == pytest.approx(a / (a + b))
