"""What holds for every learner, and what each claims: formulas recomputed naively, probabilities true."""

from __future__ import annotations

import json
from math import log, sqrt
from typing import Any

import numpy as np
import pytest
from shift_learner.learner import Context, Learner, Row, Taken, state_names
from shift_learner.learners import LEARNERS, learner_named, linear_thompson, thompson
from shift_learner.learners.tabular import Memory, Tabular, greedy
from shift_model.vocabulary import LearnerName
from shift_schemas.errors import InvalidStudy
from shift_study.study import Study

NAMES = list(LEARNERS)


def context(name: str, **settings: Any) -> Context:
    return Context(Study.model_validate({"study": "s", "learner": {"name": name} | settings}))


def lived(learner: Learner, where: Context, interactions: int) -> tuple[Any, list[tuple[int, int, float]]]:
    rng = np.random.default_rng(5)
    memory, seen = learner.initial(where), []
    for n in range(1, interactions + 1):
        triple, action = int(rng.integers(30)), int(rng.integers(where.actions))
        reward = float(rng.choice([-1, 1]) * rng.uniform(0.4, 0.7))
        taken = Taken(n, triple, where.suggestions[triple], action, 1.0)
        memory = learner.on_decision(where, memory, taken)
        memory = learner.on_reward(where, memory, taken, reward, None)
        seen.append((triple, action, reward))
    return memory, seen


def all_rows(learner: Learner, where: Context, memory: Any) -> list[Row]:
    return [learner.row(where, memory, i) for i in range(len(state_names(learner, where)))]


def test_every_name_of_the_interface_has_a_learner() -> None:
    assert set(NAMES) == set(LearnerName.__args__)  # type: ignore[attr-defined]
    with pytest.raises(InvalidStudy, match="there is no learner 'x'"):
        learner_named("x")


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("interactions", [0, 60])
@pytest.mark.parametrize("prior", [True, False])
def test_rows_are_distributions_and_memory_comes_back_exactly(name: str, interactions: int, prior: bool) -> None:
    where, learner = context(name, scoring_prior=prior), LEARNERS[name]
    memory, _ = lived(learner, where, interactions)
    rows = all_rows(learner, where, memory)
    for row in rows:
        assert sum(row.probabilities) == pytest.approx(1.0)
        assert min(row.probabilities) >= 0
        assert len(row.probabilities) == len(row.values) == len(row.visits) == where.actions
        json.dumps(row.values, allow_nan=False)
    again = learner.load(where, json.loads(json.dumps(learner.dump(memory))))
    assert all_rows(learner, where, again) == rows
    assert learner.dump(again) == learner.dump(memory)


@pytest.mark.parametrize("name", NAMES)
def test_a_function_of_a_learner_leaves_the_old_memory_standing(name: str) -> None:
    where, learner = context(name), LEARNERS[name]
    memory, _ = lived(learner, where, 10)
    before = json.dumps(learner.dump(memory))
    taken = Taken(11, 7, where.suggestions[7], 2, 0.5)
    learner.on_reward(where, learner.on_decision(where, memory, taken), taken, 0.4, None)
    assert json.dumps(learner.dump(memory)) == before


@pytest.mark.parametrize("name", [n for n in NAMES if n not in ("scoring", "q-learning")])
def test_with_the_prior_the_suggestion_is_the_most_probable_at_first(name: str) -> None:
    where, learner = context(name), LEARNERS[name]
    for triple in range(15, 30):
        row = learner.row(where, learner.initial(where), triple).probabilities
        assert row.index(max(row)) == where.suggestions[triple]


def test_epsilon_greedy_is_the_mean_with_the_prior_as_one_result() -> None:
    where, learner = context("epsilon-greedy", epsilon=0.6), LEARNERS["epsilon-greedy"]
    memory, seen = lived(learner, where, 50)
    for triple in range(30):
        row = learner.row(where, memory, triple)
        for action in range(6):
            rewards = [r for t, a, r in seen if (t, a) == (triple, action)]
            first = 1.0 if action == where.suggestions[triple] else 0.0
            assert row.values[action] == pytest.approx(np.mean([first, *rewards]))
            best = row.values.index(max(row.values)) == action
            assert row.probabilities[action] == pytest.approx(0.6 * 0.5 / 6 + (1 - 0.6 * 0.5) * best)


def test_ucb1_is_auers_bound_on_rewards_between_0_and_1() -> None:
    where, learner = context("ucb1", exploration=0.7), LEARNERS["ucb1"]
    memory, seen = lived(learner, where, 300)
    for triple in range(30):
        row = learner.row(where, memory, triple)
        here = [(a, r) for t, a, r in seen if t == triple]
        for action in range(6):
            rewards = [(r + 1) / 2 for a, r in here if a == action]
            if rewards:
                bound = np.mean(rewards) + 0.7 * sqrt(2 * log(len(here)) / len(rewards))
                assert row.values[action] == pytest.approx(bound)
        assert row.probabilities[row.values.index(max(row.values))] == 1.0


# --- Thompson sampling: the probability of the largest sample ---


def test_two_beta_arms_have_the_closed_form() -> None:
    """P(X > Y) for X ~ Beta(2, 1), Y ~ Beta(1, 1) is the mean of X, 2/3."""
    assert thompson.chances((2.0, 1.0), (1.0, 1.0)) == pytest.approx([2 / 3, 1 / 3], abs=1e-6)
    assert thompson.chances((1.0,) * 6, (1.0,) * 6) == pytest.approx([1 / 6] * 6, abs=1e-9)


def test_beta_chances_are_how_often_sampling_would_choose() -> None:
    a, b = (3.0, 1.0, 5.5, 2.0, 40.0, 1.0), (2.0, 1.0, 4.0, 9.0, 31.0, 6.0)
    samples = np.random.default_rng(1).beta(a, b, (400_000, 6))
    frequencies = np.bincount(samples.argmax(axis=1), minlength=6) / len(samples)
    assert thompson.chances(a, b) == pytest.approx(frequencies.tolist(), abs=0.004)


def test_a_finer_grid_changes_beta_chances_by_less_than_it_says(monkeypatch: pytest.MonkeyPatch) -> None:
    a, b = (90.0, 80.0, 5.0, 1.0, 1.0, 2.5), (12.0, 12.0, 1.0, 5.0, 1.0, 3.0)
    coarse = thompson.chances(a, b)
    monkeypatch.setattr(thompson, "POINTS", 16 * 1024 + 1)
    thompson.chances.cache_clear()
    assert coarse == pytest.approx(thompson.chances(a, b), abs=5e-5)
    thompson.chances.cache_clear()


def test_normal_chances_are_how_often_sampling_would_choose() -> None:
    means, deviations = (0.0, 0.1, 0.4, -1.0), (1.0, 0.2, 0.05, 2.0)
    samples = np.random.default_rng(1).normal(means, deviations, (400_000, 4))
    frequencies = np.bincount(samples.argmax(axis=1), minlength=4) / len(samples)
    assert linear_thompson.chances(means, deviations) == pytest.approx(frequencies.tolist(), abs=0.004)


@pytest.mark.parametrize("states", ["cognitive", "triples"])
def test_beta_posteriors_count_per_state_or_per_triple(states: str) -> None:
    where, learner = context("thompson", thompson_states=states, prior_strength=2.0), LEARNERS["thompson"]
    memory, seen = lived(learner, where, 80)
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


def test_linear_thompson_is_ridge_regression() -> None:
    where, learner = context("linear-thompson", noise=0.3, prior_strength=2.0), LEARNERS["linear-thompson"]
    memory, seen = lived(learner, where, 80)
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


# --- a learner of one's own ---


class WinStay(Tabular):
    """Takes what has gone best here, and what was never tried before what went badly."""

    name = "ucb1"  # a study's learner is one of the interface's names

    def row(self, context: Context, memory: Memory, state: int) -> Row:
        visits = memory.visits[state]
        values = [total / n if n else 0.0 for total, n in zip(memory.rewards[state], visits, strict=True)]
        return Row(greedy(values), values, list(visits))


def test_a_learner_of_twenty_lines_runs_in_the_cores_and_in_simulation(monkeypatch: pytest.MonkeyPatch) -> None:
    from shift_simulator.compare import rewards_of
    from shift_simulator.random_streams import session_seed
    from shift_simulator.session import play
    from shift_simulator.users import paper_user

    monkeypatch.setitem(LEARNERS, "ucb1", WinStay())
    study = Study.model_validate({"study": "s", "learner": {"name": "ucb1"}})
    played = list(play(paper_user("A"), study, session_seed(2, 0), 40))
    assert all(e.decision.policy_source == "learner" for e in played)
    simulated = rewards_of("ucb1", paper_user("A"), 2, 1, episodes=40)
    assert [e.performance.cumulative_reward for e in played] == simulated[:, 0].tolist()


# --- studies at their edges ---

SIX = {f"s{i}": {"levels": ["off", "on"], "thresholds": [0.5]} for i in range(6)}
ROWS = {
    "capacity": ("low", "high"),
    "gaze": ("distracted", "uncertain", "focused"),
    "awareness": ("unknown", "failure", "misconception_enabledness", "misconception_comprehension", "success"),
}
TABLE = {part: {row: dict.fromkeys(SIX, 0.5) for row in rows} for part, rows in ROWS.items()}
EDGES: list[dict[str, Any]] = [
    {"capacity": {"start": 0, "max": 0}},
    {"capacity": {"threshold": 0}},
    {"capacity": {"threshold": 5}},
    {"capacity": {"recovery": 0.07, "demanding_cost": 0.013}},
    {"capacity": {"start": 1e6, "max": 1e6}},
    {
        "scoring": {"strategies": {**SIX, "negation": None, "hesitation": None}, "table": TABLE},
        "capacity": {"demanding": ["on"]},
    },
    {"scoring": {"strategies": {"negation": None}}, "capacity": {"demanding": []}},
    {"reward": {"scale": 0}},
    {"interactions": 1},
    {"learner": {"planning_horizon": 0, "planning_discount": 1, "scoring_prior": False, "prior_strength": 0}},
    {"learner": {"change_probability": 0, "exploration": 0, "epsilon": 0}},
]


@pytest.mark.parametrize("edge", EDGES, ids=lambda edge: str(edge)[:40])
@pytest.mark.parametrize("name", NAMES)
def test_rows_stay_distributions_at_the_edges_of_what_a_study_can_say(name: str, edge: dict[str, Any]) -> None:
    settings = {"name": name} | edge.get("learner", {})
    where = Context(Study.model_validate({"study": "s"} | edge | {"learner": settings}))
    learner = LEARNERS[name]
    memory, _ = lived(learner, where, 4)
    for row in all_rows(learner, where, memory):
        assert sum(row.probabilities) == pytest.approx(1.0)
        assert min(row.probabilities) >= 0
        json.dumps(row.values, allow_nan=False)
