"""Processing capacity over strategies and sessions, compared with the paper's case equation."""

from __future__ import annotations

import random

import pytest
from shift_monitor.capacity import Capacity, apply_strategy
from shift_study.constants import CapacitySettings
from support.monitor_sessions import AFFIRMATION, NEGATION, configured_session, decision, fold, last, study

SETTINGS = CapacitySettings()
STRATEGIES = [
    {"negation": negation, "hesitation": hesitation}
    for negation in ("affirmation", "negation_affirmation", "negation")
    for hesitation in ("none", "hesitation")
]


def test_first_strategy_is_not_a_repetition() -> None:
    assert apply_strategy(Capacity(1.0), AFFIRMATION, SETTINGS).value == pytest.approx(0.9)


def test_any_negation_costs_more_than_an_affirmation() -> None:
    assert apply_strategy(Capacity(1.0), NEGATION, SETTINGS).value == pytest.approx(0.8)
    mixed = {"negation": "negation_affirmation", "hesitation": "none"}
    assert apply_strategy(Capacity(1.0), mixed, SETTINGS).value == pytest.approx(0.8)


def test_another_level_of_one_strategy_is_not_a_repetition() -> None:
    before = Capacity(0.5, AFFIRMATION)
    assert apply_strategy(before, AFFIRMATION | {"hesitation": "hesitation"}, SETTINGS).value == pytest.approx(0.4)
    assert apply_strategy(before, AFFIRMATION, SETTINGS).value == pytest.approx(0.8)


def test_capacity_follows_the_equation_of_the_paper_over_random_sessions() -> None:
    rng = random.Random(1)
    for _ in range(50):
        capacity, value, before = Capacity(1.0), 1.0, None
        for _ in range(100):
            strategy = rng.choice(STRATEGIES)
            capacity = apply_strategy(capacity, strategy, SETTINGS)
            if strategy == before:
                value = min(value + 0.3, 1.0)
            elif strategy["negation"] == "affirmation":
                value = max(value - 0.1, 0.0)
            else:
                value = max(value - 0.2, 0.0)
            before = strategy
            assert capacity.value == value


def test_observation_follows_the_executed_strategies() -> None:
    _, facts = fold(
        configured_session(),
        *(decision(n + 1, s) for n, s in enumerate([NEGATION, AFFIRMATION, NEGATION, AFFIRMATION])),
    )
    assert last(facts).capacity.value == pytest.approx(0.4)
    assert last(facts).capacity.category == "low"
    assert last(facts).seen.decision == 4


def test_costs_come_from_the_study() -> None:
    settings = study(capacity={"other_cost": 0.4, "demanding": ["negation"]})
    _, facts = fold(
        configured_session(settings), decision(1, {"negation": "negation_affirmation", "hesitation": "none"})
    )
    assert last(facts).capacity.value == pytest.approx(0.6)
