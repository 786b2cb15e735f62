"""Processing capacity: a battery that explanations draw on (paper, section III-A1). Pure.

Every number comes from the study's ``capacity`` settings.
"""

from __future__ import annotations

from dataclasses import dataclass

from shift_model.vocabulary import CapacityClass
from shift_schemas.messages import Strategy
from shift_study.study import CapacitySettings

MARGIN = 1e-9
"""Chosen: a value this close to a threshold is at it, so that sums of 0.1 classify as on paper (MODEL.md)."""


@dataclass(frozen=True, slots=True)
class Capacity:
    """The capacity (C) and the strategy that was executed last (A); none: there was none."""

    value: float
    strategy: Strategy | None = None


def executed(capacity: Capacity, strategy: Strategy, settings: CapacitySettings) -> Capacity:
    """The capacity after one executed strategy: the paper's case equation, C'.

    The same strategy as before, all levels, recovers it; else a demanding one costs ``demanding_cost``
    and any other ``other_cost``.
    """
    if strategy == capacity.strategy:
        value = min(capacity.value + settings.recovery, settings.max)
    else:
        value = max(capacity.value - _cost(strategy, settings), settings.min)
    return Capacity(value, strategy)


def capacity_class(value: float, settings: CapacitySettings) -> CapacityClass:
    """High at or above the threshold."""
    return "high" if value >= settings.threshold - MARGIN else "low"


def _cost(strategy: Strategy, settings: CapacitySettings) -> float:
    demanding = any(level in settings.demanding for level in strategy.values())
    return settings.demanding_cost if demanding else settings.other_cost
