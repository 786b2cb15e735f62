"""Scoring only: it always follows the suggestion; it counts visits and learns nothing."""

import json

from hypothesis import given, settings
from hypothesis import strategies as st
from shift_learner.learner import Context, DecisionView
from shift_learner.learners.scoring import Scoring
from shift_study.study import Study

LEARNER, KNOWN = Scoring(), Context(Study(study="x"))


@settings(deadline=None)
@given(st.lists(st.tuples(st.integers(0, 5), st.integers(0, 5), st.floats(-1, 1)), max_size=20))
def test_scoring_follows_the_suggestion_for_any_rewards(history: list[tuple[int, int, float]]) -> None:
    memory = LEARNER.initial(KNOWN)
    visits = [[0] * 6 for _ in range(6)]
    for n, (state, action, reward) in enumerate(history, start=1):
        taken = DecisionView(n, 0, state, action, 1.0)
        memory = LEARNER.on_reward(KNOWN, LEARNER.on_decision(KNOWN, memory, taken), taken, reward, None)
        visits[state][action] += 1
    for state in range(6):
        row = LEARNER.row(KNOWN, memory, state)
        assert row.probabilities == row.values == [float(a == state) for a in range(6)]
        assert row.visits == visits[state]
    assert LEARNER.load(KNOWN, json.loads(json.dumps(LEARNER.dump(memory)))) == memory


def test_scoring_neither_explores_nor_waits() -> None:
    assert LEARNER.epsilon(KNOWN, LEARNER.initial(KNOWN)) is None
    assert not LEARNER.needs_following(KNOWN)
