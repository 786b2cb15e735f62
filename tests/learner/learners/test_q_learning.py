"""The paper's learner: its row is the exact distribution of its rule, and its update is that of Watkins."""

from __future__ import annotations

import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shift_learner.learner import Context, DecisionView
from shift_learner.learners.q_learning import Memory, QLearning
from shift_study.loading import study_of

LEARNER = QLearning()
cells = st.tuples(st.integers(0, 5), st.integers(0, 5))
updates = st.lists(st.tuples(cells, st.floats(-1, 1), st.none() | st.integers(0, 5)), max_size=30)


def context(**given: object) -> Context:
    """Return a context with these settings of the learner."""
    return Context(study_of({"study": "x", "learner": given}))


def taken(state: int, action: int, n: int = 1) -> DecisionView:
    """Return a decision."""
    return DecisionView(n=n, triple=0, cognitive_state=state, action=action, propensity=0.5)


def after(known: Context, *actions: int) -> Memory:
    """Return the memory after decisions for these actions."""
    memory = LEARNER.initial(known)
    for n, action in enumerate(actions, start=1):
        memory = LEARNER.on_decision(known, memory, taken(0, action, n))
    return memory


def with_values(memory: Memory, state: int, values: list[float]) -> Memory:
    """Return the memory with other values in one state."""
    table = list(memory.values)
    table[state] = tuple(values)
    return Memory(tuple(table), memory.visits, memory.taken, memory.decisions)


def test_prior_is_one_on_the_own_action_of_each_state() -> None:
    table = LEARNER.initial(context()).values
    assert table == tuple(tuple(float(a == s) for a in range(6)) for s in range(6))


def test_values_without_the_prior_are_zero() -> None:
    assert LEARNER.initial(context(scoring_prior=False)).values == ((0.0,) * 6,) * 6
    assert LEARNER.initial(context(prior_value=0.5)).values[2][2] == 0.5


def test_first_row_is_an_eighth_each_and_a_quarter_more_on_the_suggested_action() -> None:
    known = context()
    for state in range(6):
        row = LEARNER.row(known, LEARNER.initial(known), state).probabilities
        assert row == [0.75 / 6 + 0.25 * (a == state) for a in range(6)]
        assert row[state] == 0.375


@pytest.mark.parametrize("decisions", [0, 1, 50, 99, 100, 101, 1000])
def test_epsilon_falls_linearly_to_0_over_the_planned_interactions(decisions: int) -> None:
    known = context()
    memory = after(known, *[0] * decisions)
    assert LEARNER.epsilon(known, memory) == 0.75 * max(0.0, 1 - decisions / 100)
    assert LEARNER.epsilon(known, memory) >= 0


def test_epsilon_falls_over_the_interactions_of_the_study() -> None:
    known = Context(study_of({"study": "x", "interactions": 4, "learner": {"epsilon": 1.0}}))
    assert [LEARNER.epsilon(known, after(known, *[0] * n)) for n in range(6)] == [1.0, 0.75, 0.5, 0.25, 0.0, 0.0]


def test_exploration_tries_untaken_actions_first() -> None:
    known = context()
    memory = after(known, 0, 2, 2)
    row = LEARNER.row(known, memory, 0).probabilities
    epsilon = 0.75 * 0.97
    assert row == pytest.approx([1 - epsilon, epsilon / 4, 0.0, epsilon / 4, epsilon / 4, epsilon / 4], abs=1e-15)


def test_untaken_actions_are_counted_over_the_run_and_not_per_state() -> None:
    known = context()
    memory = LEARNER.on_decision(known, LEARNER.initial(known), taken(3, 1))
    assert LEARNER.row(known, memory, 5).probabilities[1] == 0.0


def test_exploration_is_uniform_once_all_actions_were_taken() -> None:
    known = context()
    epsilon = 0.75 * 0.94
    row = LEARNER.row(known, after(known, 0, 1, 2, 3, 4, 5), 4).probabilities
    assert row == pytest.approx([epsilon / 6 + (1 - epsilon) * (a == 4) for a in range(6)], abs=1e-15)


def test_greedy_ties_go_to_the_first_action() -> None:
    known = context(epsilon=0.0, scoring_prior=False)
    memory = LEARNER.initial(known)
    assert LEARNER.row(known, memory, 3).probabilities == [1, 0, 0, 0, 0, 0]
    memory = with_values(memory, 3, [-1.0, 0.2, 0.2, 0.2, -1.0, 0.2])
    assert LEARNER.row(known, memory, 3).probabilities == [0, 1, 0, 0, 0, 0]


@settings(deadline=None)
@given(st.lists(st.integers(0, 5), max_size=120), st.lists(st.floats(-1, 1), min_size=6, max_size=6), st.floats(0, 1))
def test_every_row_is_a_distribution(actions: list[int], values: list[float], epsilon: float) -> None:
    known = context(epsilon=epsilon)
    row = LEARNER.row(known, with_values(after(known, *actions), 2, values), 2)
    assert sum(row.probabilities) == pytest.approx(1.0, abs=1e-12)
    assert min(row.probabilities) >= 0
    assert row.probabilities[values.index(max(values))] >= 1 - epsilon - 1e-12
    assert row.values == values


@settings(deadline=None)
@given(updates, st.floats(0, 1), st.floats(0, 1), st.booleans())
def test_update_is_that_of_q_learning(history: list, rate: float, discount: float, prior: bool) -> None:  # type: ignore[type-arg]
    known = context(learning_rate=rate, discount=discount, scoring_prior=prior)
    memory = LEARNER.initial(known)
    table = [[float(prior and a == s) for a in range(6)] for s in range(6)]
    visits = [[0] * 6 for _ in range(6)]
    for (state, action), reward, following in history:
        next_one = None if following is None else taken(following, 0, 2)
        memory = LEARNER.on_reward(known, memory, taken(state, action), reward, next_one)
        target = reward + (discount * max(table[following]) if following is not None else 0)
        table[state][action] += rate * (target - table[state][action])
        visits[state][action] += 1
    assert [list(row) for row in memory.values] == table
    assert [list(row) for row in memory.visits] == visits
    assert memory.decisions == 0, "epsilon counts decisions, not rewards"


def test_learner_waits_for_the_next_state_only_with_a_discount() -> None:
    assert not LEARNER.needs_following(context())
    assert LEARNER.needs_following(context(discount=0.01))


@settings(deadline=None)
@given(updates, st.lists(st.integers(0, 5), max_size=8))
def test_memory_survives_plain_json(history: list, actions: list[int]) -> None:  # type: ignore[type-arg]
    known = context(discount=0.5)
    memory = after(known, *actions)
    for (state, action), reward, _ in history:
        memory = LEARNER.on_reward(known, memory, taken(state, action), reward, None)
    assert LEARNER.load(known, json.loads(json.dumps(LEARNER.dump(memory)))) == memory


def test_functions_do_not_change_the_given_memory() -> None:
    known = context()
    memory = LEARNER.initial(known)
    before = json.dumps(LEARNER.dump(memory))
    LEARNER.on_decision(known, memory, taken(1, 2))
    LEARNER.on_reward(known, memory, taken(1, 2), 0.5, None)
    assert json.dumps(LEARNER.dump(memory)) == before
