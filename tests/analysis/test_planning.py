"""Planning: the power is the textbook's, and the simulated sessions are those of the simulator."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
import pytest
from shift_analysis.planning import (
    MOST,
    PlannedStudy,
    need,
    plan_of,
    power_of_differences,
    power_of_two_groups,
    simulate_all,
    simulate_planned,
)
from shift_simulator.session import play
from shift_simulator.users import paper_user
from shift_study.loading import given_study, patched, study_json
from shift_study.study import Study


def study(**given: object) -> Study:
    return given_study({"study": "x", "interactions": 20, **given})


def planned(first: Study, learner: str) -> PlannedStudy:
    return PlannedStudy(study_json(first), study_json(patched(first, {"learner": {"name": learner}})))


@pytest.mark.parametrize(("effect", "sessions"), [(0.2, 394), (0.5, 64), (0.8, 26)])
def test_two_groups_need_what_cohen_s_table_says(effect: float, sessions: int) -> None:
    """Cohen (1988), table 2.4.1: power 0.80, two-sided 5 %; his 393 is rounded from 393.4."""
    found = need(effect, 1.0, 0.8, power_of_two_groups)
    assert found.sessions == sessions
    assert found.power[20] == power_of_two_groups(effect, 20)


@pytest.mark.parametrize(("effect", "sessions"), [(0.2, 199), (0.5, 34), (0.8, 15)])
def test_differences_need_what_g_power_says(effect: float, sessions: int) -> None:
    """G*Power 3.1, "difference from constant", two-sided 5 %, power 0.80."""
    assert need(effect, 1.0, 0.8, power_of_differences).sessions == sessions


def test_power_is_the_share_of_simulated_tests() -> None:
    rng = np.random.default_rng(1)
    data = rng.normal(0.5, 1.0, (20_000, 12))
    t = data.mean(axis=1) / (data.std(axis=1, ddof=1) / np.sqrt(12))
    share = (abs(t) > 2.200985).mean()  # t(0.975, 11)
    assert power_of_differences(0.5, 12) == pytest.approx(share, abs=0.015)


@pytest.mark.parametrize("of", [power_of_two_groups, power_of_differences])
@pytest.mark.parametrize("effect", [0.05, 0.2, 0.5, 1.0, 3.0])
def test_power_rises_with_the_sessions_and_stays_within_0_and_1(of: Callable[..., float], effect: float) -> None:
    powers = [of(effect, n) for n in [*range(1, 60), *range(60, 600, 7), 1000, 3000, MOST]]
    assert all(0 <= p <= 1 + 1e-9 for p in powers)
    assert all(after >= before - 1e-6 for before, after in itertools.pairwise(powers))


def test_no_difference_needs_more_than_anybody_records() -> None:
    found = need(0.0, 1.0, 0.8, power_of_two_groups)
    assert found.sessions is None
    assert found.power[160] == pytest.approx(0.05, abs=1e-6)
    assert need(0.001, 1.0, 0.8, power_of_two_groups).sessions is None
    assert power_of_two_groups(0.01, MOST) < 0.8


def test_session_of_a_user_is_that_of_the_simulator() -> None:
    first = study(learner={"name": "thompson"})
    given = PlannedStudy(study_json(first), study_json(first), (paper_user("B"),))
    found = simulate_planned(given, 5)
    played = list(play(paper_user("B"), first, 5, 20))
    assert found.rewards == [episode.performance.reward for episode in played]
    assert found.actions == [episode.action for episode in played]
    assert found.reward == found.other_reward
    assert [row[a] for row, a in zip(found.other_probabilities, found.actions, strict=True)] == found.propensities
    assert all(found.supported)


def test_log_without_exploration_cannot_answer_and_a_minimum_propensity_can() -> None:
    without = plan_of(list(simulate_all(planned(study(learner={"name": "scoring"}), "ucb1"), 10, 0, 1)), 0.8)
    assert without.support < 1
    assert "decider.minimum_propensity" in without.warnings[0]
    first = study(learner={"name": "scoring"}, decider={"minimum_propensity": 0.05})
    found = plan_of(list(simulate_all(planned(first, "ucb1"), 10, 0, 1)), 0.8)
    assert found.support == 1
    assert not any("minimum_propensity" in warning for warning in found.warnings)


def test_workers_give_what_one_process_gives() -> None:
    given = planned(study(), "thompson")
    assert list(simulate_all(given, 10, 3, 2)) == list(simulate_all(given, 10, 3, 1))


def test_people_differ_and_every_family_takes_part() -> None:
    given = planned(study(), "thompson")
    people = [given.person(seed) for seed in range(14)]
    assert len({str(person.success) for person in people}) == 14
    assert any(person.changes for person in people)
