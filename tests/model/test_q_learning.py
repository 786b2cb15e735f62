"""The Q-learning update and the decay of epsilon, compared with the formulas."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shift_model.q_learning import decayed_epsilon, updated_value

numbers = st.floats(-1, 1)
shares = st.floats(0, 1)


def test_value_moves_by_the_learning_rate_towards_the_target() -> None:
    assert updated_value(1.0, -1.0, 0.0, learning_rate=0.25, discount=0.0) == 0.5
    assert updated_value(0.0, 1.0, 0.5, learning_rate=1.0, discount=0.5) == 1.25


@given(st.lists(st.tuples(numbers, numbers, numbers), min_size=1, max_size=9), shares, shares)
def test_arrays_give_the_bits_of_scalars(rows: list[tuple[float, float, float]], rate: float, discount: float) -> None:
    value, reward, best_next = (np.array(column) for column in zip(*rows, strict=True))
    found = updated_value(value, reward, best_next, learning_rate=rate, discount=discount)
    assert found.tolist() == [updated_value(*row, learning_rate=rate, discount=discount) for row in rows]


@pytest.mark.parametrize(("decisions", "expected"), [(0, 0.75), (50, 0.375), (100, 0.0), (1000, 0.0)])
def test_epsilon_falls_linearly_to_zero(decisions: int, expected: float) -> None:
    assert decayed_epsilon(0.75, decisions, 100) == expected
