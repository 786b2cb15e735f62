"""The capacity equation against the paper's cases, and the same bits for arrays."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shift_model.capacity import capacity_class, is_high, next_capacity, strategy_cost

PAPER: dict[str, Any] = {"recovery": 0.3, "minimum": 0.0, "maximum": 1.0}
numbers = st.floats(0, 1)
moves = st.tuples(numbers, st.booleans(), numbers)


@pytest.mark.parametrize(
    ("value", "repeated", "cost", "after"),
    [(0.5, True, 0.2, 0.8), (0.9, True, 0.2, 1.0), (0.5, False, 0.2, 0.3), (0.1, False, 0.2, 0.0)],
)
def test_capacity_follows_the_three_cases_of_the_paper(value: float, repeated: bool, cost: float, after: float) -> None:
    assert next_capacity(value, repeated, cost, **PAPER) == pytest.approx(after)


@given(st.lists(moves, min_size=1, max_size=9), numbers)
def test_arrays_give_the_bits_of_scalars(rows: list[tuple[float, bool, float]], recovery: float) -> None:
    settings = PAPER | {"recovery": recovery}
    values, repeated, costs = (np.array(column) for column in zip(*rows, strict=True))
    assert next_capacity(values, repeated, costs, **settings).tolist() == [next_capacity(*r, **settings) for r in rows]


def test_one_demanding_level_makes_a_strategy_demanding() -> None:
    demanding = ["negation", "negation_affirmation"]
    assert strategy_cost(("negation", "none"), demanding, 0.2, 0.1) == 0.2
    assert strategy_cost(("affirmation", "hesitation"), demanding, 0.2, 0.1) == 0.1
    assert strategy_cost((), demanding, 0.2, 0.1) == 0.1


def test_class_has_a_margin_at_the_threshold() -> None:
    assert capacity_class(0.5, 0.5) == "high"
    assert capacity_class(0.5 - 1e-10, 0.5) == "high"
    assert capacity_class(0.5 - 1e-8, 0.5) == "low"


@given(st.lists(numbers, min_size=1, max_size=9), numbers)
def test_class_is_high_at_or_above_the_threshold(values: list[float], threshold: float) -> None:
    assert is_high(np.array(values), threshold).tolist() == [is_high(v, threshold) for v in values]
    assert [capacity_class(v, threshold) == "high" for v in values] == [is_high(v, threshold) for v in values]
