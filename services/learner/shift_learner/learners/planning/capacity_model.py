"""The capacity equation on a lattice of values, which the look-ahead plans over. Pure.

The equation is in ``shift_model.capacity``. Arrays end with an axis of runs.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from shift_model.capacity import is_high
from shift_study.constants import CapacitySettings
from shift_study.study import Study

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
    costs = [s.cost_of(levels) for levels in study.scoring.actions]
    values = _reachable(s, set(costs))
    up = _nearest(values, s.after(values, True, 0.0))
    down = np.stack([_nearest(values, s.after(values, False, cost)) for cost in costs])
    return CapacityModel(s, np.array(costs), values, up, down, is_high(values, s.threshold).astype(np.int64))


def _reachable(s: CapacitySettings, costs: set[float]) -> Floats:
    """Return all values that actions lead to from the start; values that differ by rounding are one."""
    found = {round(s.start, 9)}
    queue = list(found)
    for value in queue:
        steps = [(True, 0.0), *((False, cost) for cost in sorted(costs))]
        for after in (round(s.after(value, repeated, cost), 9) for repeated, cost in steps):
            if after not in found:
                found.add(after)
                queue.append(after)
        if len(found) > MOST_LEVELS:
            return np.linspace(s.min, s.max, MOST_LEVELS)
    return np.array(sorted(found))


def _nearest(values: Floats, wanted: Floats) -> Ints:
    nearest: Ints = np.abs(values - wanted[:, None]).argmin(axis=1)
    return nearest
