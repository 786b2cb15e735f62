"""Table II and users A to D: naive computation of the measures, and the frozen criterion on several seeds."""

from __future__ import annotations

import numpy as np
import pytest
from shift_simulator.criterion import CROSSINGS, passed
from shift_simulator.random_streams import session_seed
from shift_simulator.session import play
from shift_simulator.table2 import PAPER, table2, zero_crossings
from shift_simulator.user_study import crossing, users
from shift_simulator.users import paper_user
from shift_study.study import Study


def naive_z(curve: list[float]) -> int:
    for episode, value in enumerate(curve):
        if value > 0:
            return episode
    return len(curve)


def naive_crossing(mean: list[float]) -> int | None:
    last = 0
    for episode, value in enumerate(mean, start=1):
        if value <= 0:
            last = episode
    return last + 1 if last < len(mean) else None


def test_z_and_crossing_equal_those_of_a_loop() -> None:
    curves = np.cumsum(np.random.default_rng(0).normal(0.02, 1, (100, 40)), axis=0)
    assert zero_crossings(curves).tolist() == [naive_z(curve) for curve in curves.T.tolist()]
    for curve in curves.T:
        assert crossing(curve[:, None]) == naive_crossing(curve.tolist())


def test_row_2_equals_sessions_of_the_cores() -> None:
    runs = 4
    rewards = [
        list(play(paper_user("A"), Study(study="s"), session_seed(9, run), 100))[-1].performance.cumulative_reward
        for run in range(runs)
    ]
    row = table2(9, runs)["rows"][1]
    assert row["r_mean"] == pytest.approx(np.mean(rewards), rel=1e-12)
    assert row["r_sd"] == pytest.approx(np.std(rewards, ddof=1), rel=1e-12)


def test_at_least_two_of_three_seeds_pass_the_whole_criterion() -> None:
    verdicts = [passed(table2(seed)["criterion"]) and passed(users(seed)["criterion"]) for seed in (101, 102, 103)]
    assert sum(verdicts) >= 2


def test_criterion_fails_with_too_few_runs() -> None:
    result = table2(0, 3)
    assert len(result["criterion"]) == 6
    assert not passed(result["criterion"])  # three runs are too few to reproduce the paper
    assert [s.row for s in PAPER] == list(range(1, 13))
    assert len(CROSSINGS) == 8


def test_same_seed_gives_the_same_numbers() -> None:
    assert table2(4, 10) == table2(4, 10)
    assert users(4, 10) == users(4, 10)
    assert users(4, 10) != users(5, 10)
