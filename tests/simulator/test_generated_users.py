"""Generated users deviate from the scoring table as documented, and the planner learns them."""

from __future__ import annotations

import numpy as np
import pytest
from shift_simulator.compare import rewards_of
from shift_simulator.generated_users import FAMILIES, flipped
from shift_simulator.users import paper_user, parse_user


def test_user_without_flipped_entries_is_user_a() -> None:
    assert flipped(np.random.default_rng(0), 0).success == paper_user("A").success


@pytest.mark.parametrize("family", FAMILIES)
def test_same_seed_gives_the_same_user_and_user_file(family: str) -> None:
    people = [FAMILIES[family](np.random.default_rng(seed)) for seed in (1, 1, 2)]
    assert people[0] == people[1]
    assert people[0] != people[2]
    text = people[0].model_dump_json(exclude_none=True)
    assert parse_user(text) == people[0]


def test_user_with_flipped_entries_has_one_right_action_per_triple() -> None:
    for seed in range(20):
        table = np.array(flipped(np.random.default_rng(seed), 8).success)
        assert (table.sum(axis=1) == 1).all()


@pytest.mark.parametrize(("family", "minimum"), [("2 entries flipped", 43), ("4 entries flipped", 37)])
def test_planner_learns_flipped_entries_within_a_session(family: str, minimum: float) -> None:
    people = [FAMILIES[family](np.random.default_rng([3, i])) for i in range(12)]
    rewards = [rewards_of("planner", user, i, 16)[-1].mean() for i, user in enumerate(people)]
    paper = [rewards_of("q-learning", user, i, 16)[-1].mean() for i, user in enumerate(people)]
    assert np.mean(rewards) > minimum
    assert np.mean(rewards) > np.mean(paper) + 25


@pytest.mark.parametrize(("name", "target"), [("A", 52.0), ("B", 46.0), ("C", 8.5), ("D", 8.5)])
def test_planner_reaches_its_targets_with_the_papers_users(name: str, target: float) -> None:
    rewards = rewards_of("planner", paper_user(name), 17, 200)[-1]
    assert rewards.mean() > target - 2 * rewards.std() / np.sqrt(len(rewards))
