"""Properties of every learner."""

from __future__ import annotations

import json
from typing import Any

import pytest
from shift_learner.learner import Context, DecisionView, Row
from shift_learner.learners import LEARNERS, learner_named
from shift_learner.learners.tabular import Memory, Tabular, greedy
from shift_model.vocabulary import LearnerName
from shift_schemas.errors import InvalidStudy
from shift_study.learner_settings import parameters_of
from shift_study.study import Study
from support.learner_histories import after_history, all_rows, context

NAMES = list(LEARNERS)


def test_every_learner_name_has_a_learner() -> None:
    assert set(NAMES) == set(LearnerName.__args__)  # type: ignore[attr-defined]
    with pytest.raises(InvalidStudy, match="there is no learner 'x'"):
        learner_named("x")


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("interactions", [0, 60])
@pytest.mark.parametrize("prior", [True, False])
def test_rows_are_distributions_and_memory_survives_json_exactly(name: str, interactions: int, prior: bool) -> None:
    where, learner = context(name, scoring_prior=prior), LEARNERS[name]
    memory, _ = after_history(learner, where, interactions)
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
def test_functions_of_a_learner_do_not_change_the_old_memory(name: str) -> None:
    where, learner = context(name), LEARNERS[name]
    memory, _ = after_history(learner, where, 10)
    before = json.dumps(learner.dump(memory))
    taken = DecisionView(11, 7, where.suggestions[7], 2, 0.5)
    learner.on_reward(where, learner.on_decision(where, memory, taken), taken, 0.4, None)
    assert json.dumps(learner.dump(memory)) == before


@pytest.mark.parametrize("name", [n for n in NAMES if "scoring_prior" in parameters_of(n) and n != "q-learning"])
def test_suggestion_is_the_most_probable_action_at_first_with_the_prior(name: str) -> None:
    where, learner = context(name), LEARNERS[name]
    for triple in range(15, 30):
        row = learner.row(where, learner.initial(where), triple).probabilities
        assert row.index(max(row)) == where.suggestions[triple]


# --- an additional learner ---


class WinStay(Tabular):
    """Takes the action with the best mean here; an untried action comes before a bad one."""

    name = "ucb1"  # a study's learner is one of the interface's names

    def row(self, context: Context, memory: Memory, state: int) -> Row:
        visits = memory.visits[state]
        values = [total / n if n else 0.0 for total, n in zip(memory.rewards[state], visits, strict=True)]
        return Row(greedy(values), values, list(visits))


def test_learner_of_twenty_lines_runs_in_the_cores_and_in_simulation(monkeypatch: pytest.MonkeyPatch) -> None:
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


# --- extreme studies ---

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
def test_rows_are_distributions_for_extreme_studies(name: str, edge: dict[str, Any]) -> None:
    settings = {"name": name} | edge.get("learner", {})
    where = Context(Study.model_validate({"study": "s"} | edge | {"learner": settings}))
    learner = LEARNERS[name]
    memory, _ = after_history(learner, where, 4)
    for row in all_rows(learner, where, memory):
        assert sum(row.probabilities) == pytest.approx(1.0)
        assert min(row.probabilities) >= 0
        json.dumps(row.values, allow_nan=False)
