"""Attention after dwells: weights, held target, focus shift and gaze class, against the paper's equations."""

from __future__ import annotations

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shift_monitor.attention import Attention, Dwell, apply_dwell, gaze_class, initial_attention, mark_aoi_seen
from shift_schemas.timestamps import NS
from shift_study.area_geometry import NOWHERE
from shift_study.constants import AttentionSettings
from support.monitor_sessions import configured_session, fold, last, names, study

SETTINGS = AttentionSettings()
STEP_NS = NS // 10
HOLD_NS = 60_000_000


def by_the_paper(weights: list[float], target: int, step: float) -> list[float]:
    """Apply the paper's equation literally; it is valid where no weight is at its floor."""
    gained = min(weights[target] + step, 1.0) - weights[target]
    return [
        min(w + step, 1.0) if i == target else max(w - gained / (len(weights) - 1), 0.0) for i, w in enumerate(weights)
    ]


def on(target: int, seconds: float, start_ns: int = 0) -> Dwell:
    return Dwell(target, start_ns, round(seconds * NS))


def test_one_application_is_the_equation_of_the_paper() -> None:
    start = initial_attention(4)
    after = apply_dwell(start, on(2, 0.1), HOLD_NS, 0, SETTINGS)
    assert after.weights == pytest.approx(by_the_paper(list(start.weights), 2, 0.1), abs=1e-15)


def test_sum_of_weights_does_not_drift_over_a_long_session() -> None:
    rng = random.Random(5)
    attention = initial_attention(7)
    for n in range(20_000):
        attention = apply_dwell(attention, on(rng.randrange(-1, 7), rng.random() / 20, n * NS), HOLD_NS, 0, SETTINGS)
        assert abs(sum(attention.weights) - 1.0) <= 1e-12


def test_single_aoi_keeps_its_weight() -> None:
    attention = apply_dwell(initial_attention(1), on(0, 5.0), HOLD_NS, 0, SETTINGS)
    assert attention.weights == (1.0,)
    assert gaze_class(mark_aoi_seen(attention), SETTINGS) == "focused"


def test_gaze_on_no_aoi_changes_no_weight() -> None:
    before = apply_dwell(initial_attention(3), on(0, 0.2), HOLD_NS, 0, SETTINGS)
    after = apply_dwell(before, on(NOWHERE, 3.0, NS), HOLD_NS, 0, SETTINGS)
    assert after.weights == before.weights
    assert after.held == NOWHERE


def shifts(*targets: int, each_s: float = 0.1) -> list[float]:
    """Return the focus shift after each of these dwells; it does not fall while a target is held."""
    settings = AttentionSettings(shift_decrease=0.0)
    attention, found = initial_attention(3), []
    for n, target in enumerate(targets):
        attention = apply_dwell(attention, on(target, each_s, round(n * each_s * NS)), HOLD_NS, 0, settings)
        found.append(attention.focus_shift)
    return found


def test_first_target_is_not_a_focus_shift() -> None:
    assert shifts(1) == [0.0]
    assert shifts(NOWHERE, 1) == [0.0, 0.0]


def test_change_of_target_is_one_focus_shift_and_return_from_none_is_not() -> None:
    assert shifts(0, 1, 1, 2) == pytest.approx([0.0, 0.2, 0.2, 0.4])
    assert shifts(0, NOWHERE, 1) == pytest.approx([0.0, 0.2, 0.2])
    assert shifts(0, NOWHERE, 0) == pytest.approx([0.0, 0.2, 0.2])


def test_gaze_on_a_border_causes_no_focus_shifts() -> None:
    assert shifts(*[0, 1] * 20, each_s=0.03)[-1] == 0.0
    assert shifts(0, 0, 1, 1, each_s=0.03)[-1] == pytest.approx(0.2)


def test_pause_longer_than_the_gap_interrupts_the_hold() -> None:
    attention = apply_dwell(initial_attention(2), on(0, 0.1), HOLD_NS, NS, SETTINGS)
    attention = apply_dwell(attention, on(1, 0.04, NS // 10), HOLD_NS, NS // 10, SETTINGS)
    close = apply_dwell(attention, on(1, 0.04, NS // 5), HOLD_NS, NS // 10, SETTINGS)
    far = apply_dwell(attention, on(1, 0.04, NS), HOLD_NS, NS // 10, SETTINGS)
    assert (close.held, far.held) == (1, 0)


def test_focus_shift_falls_while_a_target_is_held_and_stays_within_0_and_1() -> None:
    attention = Attention((0.5, 0.5), focus_shift=0.95, held=0)
    up = apply_dwell(attention, on(1, 0.06), HOLD_NS, 0, SETTINGS)
    assert up.focus_shift == 1.0
    down = apply_dwell(up, on(1, 0.2, HOLD_NS), HOLD_NS, 0, SETTINGS)
    assert down.focus_shift == pytest.approx(0.9)
    assert apply_dwell(down, on(1, 60.0, NS), HOLD_NS, 0, SETTINGS).focus_shift == 0.0


@given(st.lists(st.tuples(st.integers(-1, 2), st.integers(1, 40)), min_size=1, max_size=30), st.integers(1, 7))
def test_finer_samples_of_the_same_gaze_give_the_same_attention(gaze: list[tuple[int, int]], finer: int) -> None:
    """Dwell comes in units of 7 ms, as one sample each or cut into finer ones."""

    def after(cut: int) -> Attention:
        attention, t_ns = initial_attention(3), 0
        for target, units in gaze:
            for _ in range(cut):
                attention = apply_dwell(attention, Dwell(target, t_ns, units * 7_000_000 // cut), HOLD_NS, 0, SETTINGS)
                t_ns += units * 7_000_000 // cut
        return attention

    whole, cut = after(1), after({1: 1, 2: 2, 3: 4, 4: 5, 5: 7, 6: 8, 7: 10}[finer])
    assert cut.weights == pytest.approx(whole.weights, abs=1e-9)
    assert cut.focus_shift == pytest.approx(whole.focus_shift, abs=1e-9)
    assert cut.held == whole.held


@pytest.mark.parametrize(
    ("weights", "shift", "category"),
    [
        ((0.5, 0.5), 0.33, "focused"),
        ((0.5 - 1e-10, 0.5 + 1e-10), 0.33 + 1e-10, "focused"),
        ((0.6, 0.4), 0.34, "uncertain"),
        ((0.6, 0.4), 0.66, "distracted"),
        ((0.9, 0.1), 0.66 - 1e-10, "distracted"),
        ((0.34, 0.33, 0.33), 0.0, "distracted"),
        ((0.35 - 1e-10, 0.33, 0.32), 0.0, "uncertain"),
        ((0.49, 0.51 / 2, 0.51 / 2), 0.0, "uncertain"),
    ],
)
def test_gaze_class_has_fixed_thresholds_with_a_margin(weights: tuple[float, ...], shift: float, category: str) -> None:
    assert gaze_class(Attention(weights, shift, aoi_seen=True, dwell_ns=NS // 2), SETTINGS) == category
    assert gaze_class(Attention(weights, shift), SETTINGS) == "uncertain"


def test_gaze_class_is_uncertain_until_half_a_second_of_dwell_on_aois() -> None:
    enough = apply_dwell(mark_aoi_seen(initial_attention(2)), on(0, 0.5), HOLD_NS, 0, SETTINGS)
    too_little = apply_dwell(mark_aoi_seen(initial_attention(2)), on(0, 0.499), HOLD_NS, 0, SETTINGS)
    beside = apply_dwell(mark_aoi_seen(initial_attention(2)), on(NOWHERE, 5.0), HOLD_NS, 0, SETTINGS)
    assert [gaze_class(a, SETTINGS) for a in (enough, too_little, beside)] == ["focused", "uncertain", "uncertain"]


def test_study_without_minimum_dwell_has_a_gaze_class_from_the_first_sample() -> None:
    assert gaze_class(mark_aoi_seen(initial_attention(2)), AttentionSettings(minimum_dwell_s=0.0)) == "focused"
    assert gaze_class(initial_attention(2), AttentionSettings(minimum_dwell_s=0.0)) == "uncertain"


def test_aoi_name_stands_until_the_next_name_and_at_most_for_the_maximum() -> None:
    _, facts = fold(configured_session(), names(0, [0.0, 0.3], ["left", "right"]))
    assert last(facts).gaze.weights == pytest.approx(
        {"left": 1 / 3 + 0.3, "middle": 1 / 3 - 0.15, "right": 1 / 3 - 0.15}
    )
    slow = study(attention={"weight_step": 0.01})
    _, facts = fold(configured_session(slow), names(0, [0.0, 60.0], ["left", "right"]))
    assert last(facts).gaze.weights["left"] == pytest.approx(1 / 3 + 0.1)


def test_last_name_has_no_dwell_yet() -> None:
    state, facts = fold(configured_session(), names(0, [0.0], ["left"]))
    assert last(facts).gaze.weights["left"] == pytest.approx(1 / 3)
    _, facts = fold(state, names(1, [0.2], ["left"]))
    assert last(facts).gaze.weights["left"] == pytest.approx(1 / 3 + 0.2)
    assert last(facts).gaze.aoi == "left"
