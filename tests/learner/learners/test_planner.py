"""The planner: its beliefs, its look-ahead and its memory."""

from __future__ import annotations

import json
from itertools import product

import numpy as np
import pytest
from shift_learner.learner import Context, Taken
from shift_learner.learners.planner import Memory, Planner
from shift_learner.learners.planning import beliefs as b
from shift_learner.learners.planning.capacity_model import capacity_model_of
from shift_learner.learners.planning.lookahead import SAME_TASK, outcome_values
from shift_learner.learners.planning.plausible import plausible_people
from shift_model.vocabulary import TRIPLES
from shift_study.study import Study

CONTEXT = Context(Study.model_validate({"study": "s", "learner": {"name": "planner"}}))
PLANNER = Planner()
RNG = np.random.default_rng(4)


def lived(context: Context, interactions: int, seed: int = 1) -> Memory:
    rng = np.random.default_rng(seed)
    memory = PLANNER.initial(context)
    for n in range(1, interactions + 1):
        triple = int(rng.integers(30))
        action = int(rng.integers(context.actions))
        taken = Taken(n, triple, context.suggestions[triple], action, 1.0)
        memory = PLANNER.on_decision(context, memory, taken)
        memory = PLANNER.on_reward(context, memory, taken, float(rng.choice([-0.5, 0.5])), None)
    return memory


def rows(context: Context, memory: Memory) -> list[tuple[list[float], list[float], list[int]]]:
    return [tuple(PLANNER.row(context, memory, t)) for t in range(30)]


def test_before_anything_is_known_it_follows_the_scoring_system_where_capacity_stays_high() -> None:
    memory = PLANNER.initial(CONTEXT)
    chosen = [PLANNER.row(CONTEXT, memory, t).probabilities.index(1.0) for t in range(15, 30)]
    assert chosen == list(CONTEXT.suggestions[15:])


def test_every_row_is_a_distribution_and_its_best_value_is_the_action_taken() -> None:
    for probabilities, values, _ in rows(CONTEXT, lived(CONTEXT, 30)):
        assert sorted(probabilities) == [0, 0, 0, 0, 0, 1]
        assert probabilities.index(1.0) == values.index(max(values))


def test_its_memory_comes_back_exactly_from_json() -> None:
    memory = lived(CONTEXT, 40)
    again = PLANNER.load(CONTEXT, json.loads(json.dumps(PLANNER.dump(memory))))
    assert rows(CONTEXT, again) == rows(CONTEXT, memory)
    assert again.history == memory.history


def test_under_a_changed_study_the_history_is_folded_again() -> None:
    other = Context(Study.model_validate({"study": "s", "capacity": {"recovery": 0.1}, "learner": {"name": "planner"}}))
    memory = lived(CONTEXT, 20)
    assert rows(other, memory) == rows(other, PLANNER.load(other, PLANNER.dump(memory)))
    assert rows(other, memory) != rows(CONTEXT, memory)


def test_visits_count_reported_decisions() -> None:
    memory = lived(CONTEXT, 25)
    counted = np.zeros((30, 6), int)
    for event in memory.history:
        if len(event) == 3:
            counted[event[0], event[1]] += 1
    assert [row[2] for row in rows(CONTEXT, memory)] == counted.tolist()


def test_a_study_with_another_strategy_is_planned_for() -> None:
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
    assert all(sum(row[0]) == 1 and len(row[1]) == 12 for row in rows(context, lived(context, 5)))


def test_repeated_failures_turn_it_away_from_a_suggestion() -> None:
    memory = PLANNER.initial(CONTEXT)
    triple = 25  # high, focused, unknown: the suggestion is a plain affirmation
    assert CONTEXT.suggestions[triple] == 0
    for n in range(1, 8):
        taken = Taken(n, triple, 0, 0, 1.0)
        memory = PLANNER.on_decision(CONTEXT, memory, taken)
        memory = PLANNER.on_reward(CONTEXT, memory, taken, -0.5, None)
    assert PLANNER.row(CONTEXT, memory, triple).probabilities[0] == 0


# --- beliefs ---


def naive_beliefs(seen: list[tuple[int, int, bool]]) -> np.ndarray:
    """Return the posterior over preferences by Bayes' rule in plain loops, with the share returned each time."""
    people = plausible_people(CONTEXT.study.scoring, CONTEXT.suggestions)
    change = CONTEXT.study.learner.change_probability
    prior = people.preferences.prior
    weights = prior.copy()
    for triple, action, success in seen:
        for k in range(len(weights)):
            yes = 0.975 if people.preferences.success[k, triple * 6 + action] else 0.025
            weights[k] *= yes if success else 1 - yes
        weights = (1 - change) * weights / weights.sum() + change * prior
    return weights


def test_the_posterior_over_preferences_is_bayes_rule() -> None:
    people = plausible_people(CONTEXT.study.scoring, CONTEXT.suggestions)
    prior = b.priors(people, CONTEXT.study.learner)
    seen = [(int(RNG.integers(30)), int(RNG.integers(6)), bool(RNG.integers(2))) for _ in range(12)]
    found = b.initial(prior, 1)
    for triple, action, success in seen:
        found = b.update(found, np.array([triple]), np.array([action]), np.array([success]))
    np.testing.assert_allclose(found.preferences[0], naive_beliefs(seen), rtol=1e-9)
    for weights in (*found.columns, found.preferences, found.experts):
        np.testing.assert_allclose(weights.sum(axis=1), 1.0)
    assert ((found.chances > 0) & (found.chances < 1)).all()


@pytest.mark.parametrize("strategy", [0, 1])
def test_columns_suit_what_the_scoring_system_would_suggest_with_those_entries_flipped(strategy: int) -> None:
    people = plausible_people(CONTEXT.study.scoring, CONTEXT.suggestions)
    unflipped = people.columns[strategy].suits[0].reshape(30, -1)
    assert unflipped.argmax(axis=1).tolist() == [people.levels[a][strategy] for a in CONTEXT.suggestions]
    assert (people.columns[strategy].suits.reshape(1024, 30, -1).sum(axis=2) == 1).all()
    assert people.columns[strategy].flips[0] == 0


# --- the look-ahead ---


def naive_values(
    chance: np.ndarray, transitions: np.ndarray, share: float, depth: int, discount: float
) -> dict[object, float]:
    """Return the value of each state (capacity, previous, gaze, awareness: 0 failure, 1 success), by recursion."""
    model = capacity_model_of(CONTEXT.study)
    awareness = (1, 4)

    def expected(level: int, action: int, gaze: int, outcome: int, left: int) -> float:
        if left == 0:
            return 0.0
        total = 0.0
        for g, w in product(range(3), range(2)):
            p_w = SAME_TASK * (w == outcome) + (1 - SAME_TASK) * (share if w else 1 - share)
            total += transitions[gaze, g] * p_w * value(level, action, g, w, left)
        return total

    def value(level: int, previous: int, gaze: int, w: int, left: int) -> float:
        best = -np.inf
        for a in range(6):
            after = model.repeated[level] if a == previous else model.executed[a, level]
            p = chance[a, model.high[level], gaze, awareness[w]]
            won = 1 + discount * expected(after, a, gaze, 1, left - 1)
            lost = -1 + discount * expected(after, a, gaze, 0, left - 1)
            best = max(best, p * won + (1 - p) * lost)
        return best

    cells = product((0, 4, 10), (0, 5), range(3), range(2))
    return {cell: expected(*cell, depth) for cell in cells}


def test_looking_ahead_is_the_expectation_that_a_recursion_finds() -> None:
    chance = RNG.random((6, 2, 3, 5))
    transitions = RNG.dirichlet(np.ones(3), 3)
    found = outcome_values(
        capacity_model_of(CONTEXT.study), chance[..., None], transitions[..., None], np.array([0.3]), 2, 0.9
    )
    for (level, action, gaze, outcome), value in naive_values(chance, transitions, 0.3, 2, 0.9).items():
        assert found[action, level, gaze, outcome, 0] == pytest.approx(value)


def test_the_model_has_the_values_that_capacity_can_take() -> None:
    model = capacity_model_of(CONTEXT.study)
    assert model.values.tolist() == pytest.approx([i / 10 for i in range(11)])
    assert model.repeated.tolist() == [3, 4, 5, 6, 7, 8, 9, 10, 10, 10, 10]
    assert model.executed[2].tolist() == [0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8]
    assert len(TRIPLES) == 30
