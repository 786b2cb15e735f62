"""Processing capacity of one partner: the state, and what a decision changes (paper, section III-A1). Pure.

The equation, the costs and the classes are in ``shift_model.capacity``; the numbers are the study's ``capacity``
settings.
"""

from __future__ import annotations

from dataclasses import dataclass

from shift_model.capacity import next_capacity, strategy_cost
from shift_schemas.messages import Strategy
from shift_study.constants import CapacitySettings


@dataclass(frozen=True, slots=True)
class Capacity:
    """The capacity (C) and the strategy that was executed last (A); None before the first one."""

    value: float
    strategy: Strategy | None = None


def apply_strategy(capacity: Capacity, strategy: Strategy, settings: CapacitySettings) -> Capacity:
    """Return the capacity after one executed strategy; it repeats the one before if all levels are equal."""
    cost = strategy_cost(strategy.values(), settings.demanding, settings.demanding_cost, settings.other_cost)
    value = next_capacity(
        capacity.value,
        strategy == capacity.strategy,
        cost,
        recovery=settings.recovery,
        minimum=settings.min,
        maximum=settings.max,
    )
    return Capacity(value, strategy)
