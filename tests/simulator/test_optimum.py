"""The exact optimum equals known values, a naive recursion, and the reward of the best learner."""

from __future__ import annotations

from math import exp

import numpy as np
import pytest
from shift_schemas.errors import InvalidSettings
from shift_simulator.batched_sessions import action_costs
from shift_simulator.compare import rewards_of
from shift_simulator.optimum import optimum
from shift_simulator.users import User, paper_user
from shift_study.study import Study

STUDY = Study(study="s")


@pytest.mark.parametrize(("name", "known"), [("A", 52.7), ("B", 50.0), ("C", 10.3), ("D", 10.0)])
def test_optimum_of_the_papers_users_has_known_values(name: str, known: float) -> None:
    assert optimum(paper_user(name), STUDY, 100) == pytest.approx(known, abs=0.05)


def naive_optimum(user: User, episodes: int) -> float:
    """Return the optimum by recursion over capacity, previous action, gaze and awareness of each task."""
    s, cost = STUDY.capacity, action_costs(STUDY.capacity, STUDY)
    size = float(np.mean([exp(-0.1 * t) for t in (4, 5, 6, 7, 8)]))

    def value(n: int, capacity: float, previous: int, gaze: int, tasks: tuple[int, ...]) -> float:
        if n > episodes:
            return 0.0
        return float(np.mean([best(n, capacity, previous, gaze, tasks, i) for i in range(len(tasks))]))

    def best(n: int, capacity: float, previous: int, gaze: int, tasks: tuple[int, ...], task: int) -> float:
        return max(worth(n, capacity, previous, gaze, tasks, task, action) for action in range(6))

    def worth(
        n: int, capacity: float, previous: int, gaze: int, tasks: tuple[int, ...], task: int, action: int
    ) -> float:
        triple = 15 * (capacity >= s.threshold - 1e-9) + 5 * gaze + tasks[task]
        p = 0.025 + 0.95 * float(user.table_at(n)[triple, action])
        spent, recovered = max(capacity - float(cost[action]), s.min), min(capacity + s.recovery, s.max)
        after = recovered if action == previous else spent
        total = size * (2 * p - 1)
        for outcome, chance in ((4, p), (1, 1 - p)):
            then = (*tasks[:task], outcome, *tasks[task + 1 :])
            for g in range(3):
                turn = user.gaze.keep * (g == gaze) + (1 - user.gaze.keep) / 3
                total += chance * turn * value(n + 1, after, action, g, then)
        return total

    return value(1, s.start, -1, 2, (0,) * user.tasks)


def test_optimum_equals_a_recursion_over_all_states() -> None:
    table = np.random.default_rng(2).random((30, 6)).tolist()
    change = [{"at": 1, "success": np.random.default_rng(3).random((30, 6)).tolist()}]
    user = User.model_validate({"user": "x", "success": table, "changes": change, "tasks": 2, "gaze": {"keep": 0.5}})
    assert optimum(user, STUDY, 3) == pytest.approx(naive_optimum(user, 3), rel=1e-12)


def test_scoring_learner_reaches_the_optimum_with_user_a() -> None:
    rewards = rewards_of("scoring", paper_user("A"), 1, 400)[-1]
    assert rewards.mean() == pytest.approx(optimum(paper_user("A"), STUDY, 100), abs=4 * rewards.std() / 20)


def test_different_true_capacity_is_part_of_the_state() -> None:
    tireless = paper_user("B").model_dump() | {"capacity": {"demanding_cost": 0.05}}  # B succeeds more at low capacity
    assert optimum(User.model_validate(tireless), STUDY, 30) < optimum(paper_user("B"), STUDY, 30) - 0.3


def test_too_many_states_are_refused() -> None:
    many = User.model_validate(paper_user("A").model_dump() | {"tasks": 400})
    with pytest.raises(InvalidSettings, match="too many states"):
        optimum(many, STUDY, 2)
