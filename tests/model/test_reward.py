"""The reward, against the paper's formula written out."""

from math import exp

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shift_learner.reward import reward, task_performance
from shift_schemas.messages import Result
from shift_schemas.study import RewardSettings

durations = st.floats(0, 1e6)


@settings(deadline=None)
@given(st.booleans(), durations, st.booleans(), durations, st.floats(0, 10), st.floats(0, 10))
def test_the_reward_is_lambda_times_the_mean_of_signed_decayed_successes(
    understood: bool, understood_s: float, able: bool, able_s: float, decay: float, scale: float
) -> None:
    rules = RewardSettings(decay=decay, scale=scale)
    first = task_performance(Result(success=understood, duration_s=understood_s), rules)
    second = task_performance(Result(success=able, duration_s=able_s), rules)
    assert first.value == (1 if understood else -1) * exp(-decay * understood_s)
    assert second.value == (1 if able else -1) * exp(-decay * able_s)
    assert reward(first.value, second.value, rules) == scale * ((first.value + second.value) / 2)


@pytest.mark.parametrize(
    ("success", "duration_s", "value"),
    [(True, 0.0, 1.0), (False, 0.0, -1.0), (True, 10.0, exp(-1)), (False, 5.0, -exp(-0.5))],
)
def test_the_paper_s_constants_are_the_default(success: bool, duration_s: float, value: float) -> None:
    assert task_performance(Result(success=success, duration_s=duration_s), RewardSettings()).value == value


def test_a_result_keeps_what_was_reported() -> None:
    scored = task_performance(Result(success=False, duration_s=5.0), RewardSettings())
    assert (scored.success, scored.duration_s) == (False, 5.0)


def test_success_in_one_dimension_and_failure_in_the_other_cancel_at_equal_times() -> None:
    assert reward(exp(-0.5), -exp(-0.5), RewardSettings()) == 0.0
