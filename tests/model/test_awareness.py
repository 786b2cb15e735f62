"""Task awareness: ratios over the window and the five classes."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shift_model.awareness import awareness_class, success_ratio


@given(st.text("01", max_size=30), st.integers(1, 12))
def test_ratio_counts_successes_in_the_window(results: str, window: int) -> None:
    recent = [mark == "1" for mark in results][-window:]
    assert success_ratio(results, window) == (sum(recent) / len(recent) if recent else 0.0)


@pytest.mark.parametrize(
    ("comprehension", "enabledness", "expected"),
    [
        (0.0, 0.0, "failure"),
        (1.0, 0.0, "misconception_enabledness"),
        (0.0, 1.0, "misconception_comprehension"),
        (1.0, 1.0, "success"),
        (0.5, 0.5 - 1e-12, "success"),
    ],
)
def test_class_names_the_dimension_that_fails(comprehension: float, enabledness: float, expected: str) -> None:
    assert awareness_class(comprehension, enabledness, 0.5) == expected
