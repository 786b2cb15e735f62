"""The planner: its rows and its memory."""

from __future__ import annotations

import json

import numpy as np
from shift_learner.learner import Context, DecisionView
from shift_learner.learners.planner import Memory, Planner
from shift_study.study import Study

CONTEXT = Context(Study.model_validate({"study": "s", "learner": {"name": "planner"}}))
PLANNER = Planner()


def after_history(context: Context, interactions: int, seed: int = 1) -> Memory:
    rng = np.random.default_rng(seed)
    memory = PLANNER.initial(context)
    for n in range(1, interactions + 1):
        triple = int(rng.integers(30))
        action = int(rng.integers(context.actions))
        taken = DecisionView(n, triple, context.suggestions[triple], action, 1.0)
        memory = PLANNER.on_decision(context, memory, taken)
        memory = PLANNER.on_reward(context, memory, taken, float(rng.choice([-0.5, 0.5])), None)
    return memory


def rows(context: Context, memory: Memory) -> list[tuple[list[float], list[float], list[int]]]:
    return [tuple(PLANNER.row(context, memory, t)) for t in range(30)]


def test_planner_without_data_follows_the_scoring_system_at_high_capacity() -> None:
    memory = PLANNER.initial(CONTEXT)
    chosen = [PLANNER.row(CONTEXT, memory, t).probabilities.index(1.0) for t in range(15, 30)]
    assert chosen == list(CONTEXT.suggestions[15:])


def test_every_row_puts_all_probability_on_its_best_value() -> None:
    for probabilities, values, _ in rows(CONTEXT, after_history(CONTEXT, 30)):
        assert sorted(probabilities) == [0, 0, 0, 0, 0, 1]
        assert probabilities.index(1.0) == values.index(max(values))


def test_memory_survives_json_exactly() -> None:
    memory = after_history(CONTEXT, 40)
    again = PLANNER.load(CONTEXT, json.loads(json.dumps(PLANNER.dump(memory))))
    assert rows(CONTEXT, again) == rows(CONTEXT, memory)
    assert again.history == memory.history


def test_changed_study_folds_the_history_again() -> None:
    other = Context(Study.model_validate({"study": "s", "capacity": {"recovery": 0.1}, "learner": {"name": "planner"}}))
    memory = after_history(CONTEXT, 20)
    assert rows(other, memory) == rows(other, PLANNER.load(other, PLANNER.dump(memory)))
    assert rows(other, memory) != rows(CONTEXT, memory)


def test_visits_count_reported_decisions() -> None:
    memory = after_history(CONTEXT, 25)
    counted = np.zeros((30, 6), int)
    for event in memory.history:
        if len(event) == 3:
            counted[event[0], event[1]] += 1
    assert [row[2] for row in rows(CONTEXT, memory)] == counted.tolist()


def test_planner_works_with_an_additional_strategy() -> None:
    column = {"capacity": {"low": {"pointing": 1}, "high": {"pointing": 0}}}
    column["gaze"] = {g: {"pointing": 1} for g in ("distracted", "uncertain", "focused")}
    column["awareness"] = {
        a: {"pointing": 0}
        for a in ("unknown", "failure", "misconception_enabledness", "misconception_comprehension", "success")
    }
    pointing = {"levels": ["off", "on"], "thresholds": [0.5]}
    context = Context(
        Study.model_validate(
            {
                "study": "s",
                "learner": {"name": "planner"},
                "scoring": {"strategies": {"pointing": pointing}, "table": column},
            }
        )
    )
    assert context.actions == 12
    assert all(sum(row[0]) == 1 and len(row[1]) == 12 for row in rows(context, after_history(context, 5)))


def test_repeated_failures_turn_the_planner_away_from_a_suggestion() -> None:
    memory = PLANNER.initial(CONTEXT)
    triple = 25  # high, focused, unknown: the suggestion is a plain affirmation
    assert CONTEXT.suggestions[triple] == 0
    for n in range(1, 8):
        taken = DecisionView(n, triple, 0, 0, 1.0)
        memory = PLANNER.on_decision(CONTEXT, memory, taken)
        memory = PLANNER.on_reward(CONTEXT, memory, taken, -0.5, None)
    assert PLANNER.row(CONTEXT, memory, triple).probabilities[0] == 0
