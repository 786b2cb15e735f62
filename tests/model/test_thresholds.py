"""Comparisons with a threshold: the margin, and the same answers for arrays."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from shift_model.thresholds import MARGIN, at_most, below, reaches

numbers = st.floats(-2, 2)


def test_sum_of_tenths_reaches_its_threshold() -> None:
    assert 0.1 + 0.7 < 0.8
    assert reaches(0.1 + 0.7, 0.8)
    assert not below(0.1 + 0.7, 0.8)
    assert at_most(0.1 + 0.2, 0.3)


def test_value_beyond_the_margin_is_on_its_own_side() -> None:
    assert not reaches(0.5 - 2 * MARGIN, 0.5)
    assert below(0.5 - 2 * MARGIN, 0.5)
    assert not at_most(0.5 + 2 * MARGIN, 0.5)


@given(st.lists(numbers, min_size=1, max_size=9), numbers)
def test_arrays_give_the_scalars_answers(values: list[float], threshold: float) -> None:
    for compare in (reaches, below, at_most):
        expected = [compare(value, threshold) for value in values]
        assert compare(np.array(values), threshold).tolist() == expected
        assert [compare(value, np.array([threshold])).tolist() for value in values] == [[e] for e in expected]


@given(numbers, numbers)
def test_below_is_the_opposite_of_reaches(value: float, threshold: float) -> None:
    assert below(value, threshold) != reaches(value, threshold)
