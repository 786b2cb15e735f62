"""The attention equations against the paper's, written out."""

import random
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shift_model.attention import (
    TOTAL,
    gaze_class,
    lowered_focus_shift,
    next_weights,
    raised_focus_shift,
    uniform_weights,
)

THRESHOLDS: dict[str, Any] = {
    "focused_dominance": 0.5, "focused_shift": 0.33, "distracted_dominance": 0.35, "distracted_shift": 0.66,
}  # fmt: skip


@given(st.integers(2, 8), st.data())
def test_weights_follow_the_equation_of_the_paper_above_the_floor(targets: int, data: st.DataObject) -> None:
    target, gain = data.draw(st.integers(0, targets - 1)), 0.1 / targets
    after = next_weights(uniform_weights(targets), target, gain, 0.0)
    expected = [1 / targets + gain if i == target else 1 / targets - gain / (targets - 1) for i in range(targets)]
    assert after == pytest.approx(expected)


@given(st.lists(st.tuples(st.integers(0, 3), st.floats(0, 0.5)), max_size=20))
def test_weights_keep_their_sum_and_their_floor(dwells: list[tuple[int, float]]) -> None:
    weights = uniform_weights(4)
    for target, gain in dwells:
        weights = next_weights(weights, target, gain, 0.05)
        assert sum(weights) == pytest.approx(TOTAL)
        assert min(weights) >= 0.05 - 1e-12


def test_single_target_keeps_the_whole_weight() -> None:
    assert next_weights((1.0,), 0, 0.3, 0.0) == (1.0,)


def test_focus_shift_stays_between_its_floor_and_its_cap() -> None:
    assert raised_focus_shift(0.5, 0.2) == 0.7
    assert raised_focus_shift(0.9, 0.2) == 1.0
    assert lowered_focus_shift(0.5, 0.05) == 0.45
    assert lowered_focus_shift(0.02, 0.05) == 0.0


@pytest.mark.parametrize(
    ("dominance", "shift", "expected"),
    [
        (0.5, 0.33, "focused"), (0.9, 0.34, "uncertain"), (0.49, 0.0, "uncertain"), (0.35, 0.5, "uncertain"),
        (0.34, 0.0, "distracted"), (0.9, 0.66, "distracted"), (0.1 + 0.4 - 1e-12, 0.0, "focused"),
    ],
)  # fmt: skip
def test_gaze_class_by_both_thresholds(dominance: float, shift: float, expected: str) -> None:
    assert gaze_class(dominance, shift, **THRESHOLDS) == expected


def by_small_parts(weights: list[float], target: int, gain: float, floor: float) -> list[float]:
    """Return the weights after ten thousand small gains, each taken equally from those above the floor."""
    for _ in range(10_000):
        givers = [i for i, w in enumerate(weights) if i != target and w > floor + 1e-12]
        for i in givers:
            weights[i] -= gain / 10_000 / len(givers)
        if givers:
            weights[target] += gain / 10_000
    return weights


def test_weights_above_the_floor_give_what_those_at_the_floor_cannot() -> None:
    after = next_weights((0.5, 0.02, 0.18, 0.3), 0, 0.2, 0.0)
    assert after == pytest.approx((0.7, 0.0, 0.09, 0.21))


@given(
    parts=st.lists(st.floats(0.01, 1), min_size=2, max_size=6),
    gain=st.floats(0, 1.5),
    floor=st.sampled_from([0.0, 0.02, 0.05]),
    data=st.data(),
)
def test_one_gain_equals_the_sum_of_smaller_gains(
    parts: list[float], gain: float, floor: float, data: st.DataObject
) -> None:
    weights = [floor + (1 - floor * len(parts)) * p / sum(parts) for p in parts]
    target = data.draw(st.integers(0, len(parts) - 1))
    after = next_weights(tuple(weights), target, gain, floor)
    cut = data.draw(st.floats(0, 1))
    twice = next_weights(next_weights(tuple(weights), target, gain * cut, floor), target, gain * (1 - cut), floor)
    assert twice == pytest.approx(after, abs=1e-12)
    assert sum(after) == pytest.approx(1.0, abs=1e-12)
    assert min(after) >= floor - 1e-12


def test_redistribution_matches_a_loop_over_small_parts() -> None:
    rng = random.Random(3)
    for floor in (0.0, 0.04):
        for _ in range(5):
            parts = [rng.random() for _ in range(5)]
            weights = [floor + (1 - 5 * floor) * p / sum(parts) for p in parts]
            gain = rng.random()
            after = next_weights(tuple(weights), 1, gain, floor)
            assert after == pytest.approx(by_small_parts(weights, 1, gain, floor), abs=1e-3)
