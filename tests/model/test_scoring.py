"""Scores, ranks and action indices: the paper's numbers, and the same for arrays."""

from itertools import product

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from shift_model.scoring import action_index, level_index, scaffolding_score

entries = st.lists(st.tuples(*[st.integers(0, 1).map(float)] * 3), min_size=1, max_size=9)
thresholds = st.lists(st.floats(0, 2), max_size=3, unique=True).map(sorted)


def test_score_is_weight_times_the_share_of_the_largest_sum() -> None:
    assert scaffolding_score((1.0, 0.0, 1.0), 1.0, 3.0) == 2 / 3
    assert scaffolding_score((1.0, 1.0, 1.0), 1.5, 3.0) == 1.5


def test_score_at_a_threshold_reaches_it() -> None:
    assert level_index(0.1 + 0.7, [0.5, 0.8]) == 2
    assert level_index(0.4, [0.5, 5 / 6]) == 0
    assert level_index(0.4, []) == 0


def test_level_has_a_margin_at_the_threshold() -> None:
    assert level_index(0.5 - 1e-12, [0.5]) == 1
    assert level_index(0.5 - 1e-8, [0.5]) == 0
    assert level_index(2.5 / 3, [0.5, 5 / 6]) == 2


@given(entries, st.floats(0, 2), thresholds)
def test_arrays_give_the_bits_of_scalars(rows: list[tuple[float, ...]], weight: float, rising: list[float]) -> None:
    scores = [scaffolding_score(row, weight, 3.0) for row in rows]
    found = scaffolding_score(np.array(rows), weight, 3.0)
    assert found.tolist() == scores
    assert level_index(found, rising).tolist() == [level_index(score, rising) for score in scores]


def test_action_index_counts_the_product_of_the_levels() -> None:
    levels = list(product(range(3), range(2)))
    assert [action_index(pair, (3, 2)) for pair in levels] == list(range(6))
    assert action_index(np.array(levels).T, (3, 2)).tolist() == list(range(6))
