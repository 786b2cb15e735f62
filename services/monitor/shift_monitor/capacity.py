"""Processing capacity of one partner: the state, and what a decision changes (paper, section III-A1). Pure.

The equation, the costs and the classes are in ``shift_model.capacity``; the numbers are the study's ``capacity``
settings.
"""

from __future__ import annotations

from dataclasses import dataclass

from shift_schemas.messages import Strategy
from shift_study.constants import CapacitySettings


@dataclass(frozen=True, slots=True)
class Capacity:
    """The capacity (C) and the strategy that was executed last (A); None before the first one."""

    value: float
    strategy: Strategy | None = None


def apply_strategy(capacity: Capacity, strategy: Strategy, settings: CapacitySettings) -> Capacity:
    """Return the capacity after one executed strategy; it repeats the one before if all levels are equal."""
    repeated = strategy == capacity.strategy
    return Capacity(settings.after(capacity.value, repeated, settings.cost_of(strategy.values())), strategy)
