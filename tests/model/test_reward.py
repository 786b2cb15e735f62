"""The reward, compared with the paper's formula."""

from math import exp

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shift_model.reward import reward, task_performance

durations = st.floats(0, 1e6)


@settings(deadline=None)
@given(st.booleans(), durations, st.booleans(), durations, st.floats(0, 10), st.floats(0, 10))
def test_reward_is_lambda_times_the_mean_of_signed_decayed_successes(
    understood: bool, understood_s: float, able: bool, able_s: float, decay: float, scale: float
) -> None:
    first = task_performance(understood, understood_s, decay)
    second = task_performance(able, able_s, decay)
    assert first == (1 if understood else -1) * exp(-decay * understood_s)
    assert second == (1 if able else -1) * exp(-decay * able_s)
    assert reward(first, second, scale) == scale * ((first + second) / 2)


@pytest.mark.parametrize(
    ("success", "duration_s", "value"),
    [(True, 0.0, 1.0), (False, 0.0, -1.0), (True, 10.0, exp(-1)), (False, 5.0, -exp(-0.5))],
)
def test_task_performance_with_the_constants_of_the_paper(success: bool, duration_s: float, value: float) -> None:
    assert task_performance(success, duration_s, decay=0.1) == value


def test_success_in_one_dimension_and_failure_in_the_other_cancel_at_equal_times() -> None:
    assert reward(exp(-0.5), -exp(-0.5), scale=1.0) == 0.0


@given(st.lists(st.tuples(st.booleans(), durations), min_size=1, max_size=9), st.floats(0, 10))
def test_arrays_give_the_bits_of_scalars(rows: list[tuple[bool, float]], decay: float) -> None:
    success, duration_s = (np.array(column) for column in zip(*rows, strict=True))
    values = [task_performance(*row, decay) for row in rows]
    found = task_performance(success, duration_s, decay)
    assert found.tolist() == values
    assert reward(found, found[::-1], 0.7).tolist() == [
        reward(a, b, 0.7) for a, b in zip(values, reversed(values), strict=True)
    ]
