"""Off-policy values: as a naive loop and Vowpal Wabbit compute them, with intervals that cover the true value."""

from __future__ import annotations

import numpy as np
import pytest
import vowpalwabbit
from shift_analysis.off_policy import (
    PARTICIPANTS,
    SHRINKAGE,
    LoggedDecisions,
    estimate_values,
    is_over_participants,
    logged_value,
    reward_model,
)

ACTIONS, STATES = 6, 5


def simulated(
    rng: np.random.Generator, people: int = 10, decisions: int = 30, lowest: float = 0.02
) -> tuple[LoggedDecisions, float]:
    """Return decisions of a random logging policy, and the true value of the other policy in a population of people.

    Each person has an ability of its own, which shifts the chance of success in every state.
    """
    chance = rng.uniform(0.2, 0.8, (STATES, ACTIONS))
    logging = lowest + (1 - ACTIONS * lowest) * rng.dirichlet(np.ones(ACTIONS), STATES)
    target = rng.dirichlet(np.ones(ACTIONS), STATES)
    n = people * decisions
    group = np.repeat(np.arange(people), decisions)
    ability = np.repeat(rng.uniform(-0.15, 0.15, people), decisions)
    state = rng.integers(STATES, size=n)
    action = np.array([rng.choice(ACTIONS, p=logging[s]) for s in state])
    reward = (rng.random(n) < chance[state, action] + ability).astype(float)
    logged = LoggedDecisions(reward, action, logging[state, action], target[state], state, group)
    return logged, float((target * chance).sum(axis=1).mean())


def test_values_are_those_of_a_naive_loop() -> None:
    logged, _ = simulated(np.random.default_rng(3), people=9)
    model = reward_model(logged)
    weighted = weights = doubly = 0.0
    for i in range(len(logged)):
        w = logged.other[i, logged.action[i]] / logged.propensity[i]
        weighted += w * logged.reward[i]
        weights += w
        direct = sum(logged.other[i, a] * model[i, a] for a in range(ACTIONS))
        doubly += direct + w * (logged.reward[i] - model[i, logged.action[i]])
    ips, snips, dr = estimate_values(logged)
    assert ips.estimate == pytest.approx(weighted / len(logged), abs=1e-12)
    assert snips.estimate == pytest.approx(weighted / weights, abs=1e-12)
    assert dr.estimate == pytest.approx(doubly / len(logged), abs=1e-12)
    assert ips.ess == pytest.approx(weights**2 / (logged.weights**2).sum())
    assert ips.max_weight == logged.weights.max()


def test_model_of_the_reward_is_fitted_to_the_other_participants() -> None:
    logged, _ = simulated(np.random.default_rng(4), people=3, decisions=20)
    model = reward_model(logged)
    for i in (0, 25, 59):
        others = [j for j in range(60) if logged.group[j] != logged.group[i]]
        overall = np.mean([logged.reward[j] for j in others])
        for a in range(ACTIONS):
            same = [logged.reward[j] for j in others if logged.action[j] == a]
            action = (sum(same) + SHRINKAGE * overall) / (len(same) + SHRINKAGE)
            here = [logged.reward[j] for j in others if logged.action[j] == a and logged.state[j] == logged.state[i]]
            assert model[i, a] == pytest.approx((sum(here) + SHRINKAGE * action) / (len(here) + SHRINKAGE))


def test_model_for_a_single_participant_leaves_each_decision_out() -> None:
    logged, _ = simulated(np.random.default_rng(5), people=1, decisions=12)
    changed = LoggedDecisions(
        np.where(np.arange(12) == 3, 100.0, logged.reward), logged.action, logged.propensity, logged.other,
        logged.state, logged.group,
    )  # fmt: skip
    before, after = reward_model(logged), reward_model(changed)
    assert (before[3] == after[3]).all()
    assert (before[4] != after[4]).any()


def test_ips_is_that_of_vowpal_wabbit() -> None:
    """Vowpal Wabbit evaluates policies that choose one action; its numbers have single precision."""
    rng = np.random.default_rng(6)
    logged, _ = simulated(rng)
    chosen = rng.integers(ACTIONS, size=len(logged))
    logged = LoggedDecisions(
        logged.reward, logged.action, logged.propensity, np.eye(ACTIONS)[chosen], logged.state, logged.group
    )
    judge = vowpalwabbit.Workspace(f"--cb {ACTIONS} --eval --cb_type ips --quiet")
    for i in range(len(logged)):
        cost, propensity = -float(logged.reward[i]), float(logged.propensity[i])
        judge.learn(f"{chosen[i] + 1} {logged.action[i] + 1}:{cost!r}:{propensity!r} | s{logged.state[i]}")
    value = -judge.get_sum_loss() / judge.get_weighted_examples()
    judge.finish()
    assert estimate_values(logged)[0].estimate == pytest.approx(value, abs=1e-6)


@pytest.mark.parametrize(("people", "decisions"), [(12, 40), (30, 40), (60, 20)])
def test_intervals_cover_the_true_value(people: int, decisions: int) -> None:
    rng = np.random.default_rng(1000 * people + decisions)
    covered = {"ips": 0, "snips": 0, "dr": 0}
    for _ in range(400):
        logged, value = simulated(rng, people, decisions)
        for estimate in estimate_values(logged):
            assert estimate.low is not None
            assert estimate.high is not None
            covered[estimate.estimator] += estimate.low <= value <= estimate.high
    assert all(0.92 <= count / 400 <= 0.98 for count in covered.values()), covered


def test_intervals_of_few_participants_are_over_decisions() -> None:
    few, _ = simulated(np.random.default_rng(8), people=PARTICIPANTS - 1)
    many, _ = simulated(np.random.default_rng(8), people=PARTICIPANTS)
    assert not is_over_participants(few)
    assert is_over_participants(many)
    assert estimate_values(few)[0].low is not None


def test_value_of_the_recorded_policy_is_the_mean_reward() -> None:
    logged, _ = simulated(np.random.default_rng(9))
    found = logged_value(logged)
    assert found.estimate == pytest.approx(sum(logged.reward) / len(logged))
    assert found.low is not None
    assert found.low < found.estimate


def test_nothing_and_one_decision() -> None:
    one, _ = simulated(np.random.default_rng(10), people=1, decisions=1)
    assert [(each.low, each.high) for each in estimate_values(one)] == [(None, None)] * 3
    empty = LoggedDecisions(
        np.zeros(0), np.zeros(0, np.int64), np.zeros(0), np.zeros((0, 6)), np.zeros(0, np.int64), np.zeros(0, np.int64)
    )
    assert estimate_values(empty) == []


def test_policy_without_any_overlap_has_the_value_of_the_model_alone() -> None:
    logged, _ = simulated(np.random.default_rng(11))
    elsewhere = np.eye(ACTIONS)[(logged.action + 1) % ACTIONS]
    logged = LoggedDecisions(logged.reward, logged.action, logged.propensity, elsewhere, logged.state, logged.group)
    ips, snips, dr = estimate_values(logged)
    assert (ips.estimate, snips.estimate, ips.ess) == (0, 0, 0)
    assert dr.estimate == pytest.approx((elsewhere * reward_model(logged)).sum(axis=1).mean())
