"""The capacity equation on a lattice of values, which the look-ahead plans over. Pure.

The equation is in ``shift_model.capacity``. Arrays end with an axis of runs.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from shift_model.capacity import is_high, next_capacity, strategy_cost
from shift_study.study import CapacitySettings, Study

from shift_learner.learners.planning.plausible import Floats, Ints

MOST_LEVELS = 21
"""Chosen: the most values of capacity; the default settings reach eleven, and a grid replaces more than this."""


class CapacityModel(NamedTuple):
    """The capacity equation on a lattice of values."""

    settings: CapacitySettings
    costs: Floats
    """[actions]: the cost of each action."""
    values: Floats
    repeated: Ints
    """[values]: the value that a repeated strategy leads to."""
    executed: Ints
    """[actions, values]: the value that any other use of an action leads to."""
    high: Ints
    """[values]: the capacity class of each value, 1 for high."""

    def after(self, capacity: Floats, repeated: Ints | bool, cost: Floats | float) -> Floats:
        """Return the capacity after an action, off the lattice, by the study's equation."""
        s = self.settings
        return next_capacity(capacity, repeated, cost, recovery=s.recovery, minimum=s.min, maximum=s.max)

    def class_of(self, capacity: Floats) -> Ints:
        """Return the class of each capacity, 1 for high."""
        return is_high(capacity, self.settings.threshold).astype(np.int64)

    def level_of(self, capacity: Floats, high: Ints) -> Ints:
        """Return the index of the lattice value nearest to ``capacity`` among those of the observed class, [runs]."""
        distance = np.abs(self.values - capacity[:, None]) + 1e6 * (self.high != high[:, None])
        nearest: Ints = distance.argmin(axis=1)
        return nearest


def capacity_model_of(study: Study) -> CapacityModel:
    """Return the lattice of the reachable values, or an even grid if they are too many.

    On a grid each move leads to the nearest value.
    """
    s = study.capacity
    costs = [strategy_cost(levels, s.demanding, s.demanding_cost, s.other_cost) for levels in study.scoring.actions]
    values = _reachable(s, set(costs))
    moves = {"recovery": s.recovery, "minimum": s.min, "maximum": s.max}
    up = _nearest(values, next_capacity(values, True, 0.0, **moves))
    down = np.stack([_nearest(values, next_capacity(values, False, cost, **moves)) for cost in costs])
    return CapacityModel(s, np.array(costs), values, up, down, is_high(values, s.threshold).astype(np.int64))


def _reachable(s: CapacitySettings, costs: set[float]) -> Floats:
    """Return all values that actions lead to from the start; values that differ by rounding are one."""
    moves = {"recovery": s.recovery, "minimum": s.min, "maximum": s.max}
    found = {round(s.start, 9)}
    queue = list(found)
    for value in queue:
        steps = [(True, 0.0), *((False, cost) for cost in sorted(costs))]
        for after in (round(next_capacity(value, repeated, cost, **moves), 9) for repeated, cost in steps):
            if after not in found:
                found.add(after)
                queue.append(after)
        if len(found) > MOST_LEVELS:
            return np.linspace(s.min, s.max, MOST_LEVELS)
    return np.array(sorted(found))


def _nearest(values: Floats, wanted: Floats) -> Ints:
    nearest: Ints = np.abs(values - wanted[:, None]).argmin(axis=1)
    return nearest
