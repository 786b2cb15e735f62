"""The look ahead: value iteration over the model's own capacity equation (Bellman 1957).

Pure; arrays end with an axis of runs. A state is capacity x previous action x gaze class x awareness. Capacity
moves by the study's equation, gaze by what was seen of it. Awareness follows outcomes: the next interaction meets
the result of this one with probability ``SAME_TASK``, else a result as they were lately. Reward is +1 for a success
and -1 for a failure: how long a task takes does not depend on the action here.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from shift_model.vocabulary import AWARENESSES
from shift_study.study import Study

from shift_learner.learners.planning.plausible import Floats, Ints

MOST_LEVELS = 21
"""Chosen: of capacity; the default settings reach eleven values, and where more can be, a grid stands for them."""
SAME_TASK = 0.6
"""Chosen: higher than one in three, the chance that the next task is this one, since a result that is not met at
once is met later. Between 0.33 and 1 the reward of a planner that knows the person does not change."""
MARGIN = 1e-9
OUTCOMES = (AWARENESSES.index("failure"), AWARENESSES.index("success"))


class Battery(NamedTuple):
    """The capacity equation on a lattice of values."""

    values: Floats
    repeated: Ints
    """[values]: where a repeated strategy leads."""
    executed: Ints
    """[actions, values]: where any other use of an action leads."""
    high: Ints
    """[values]: its class."""


def battery_of(study: Study) -> Battery:
    """The reachable values, where they are few, else an even grid with the nearest value for each move."""
    s = study.capacity
    demanding = set(s.demanding)
    costs = [s.demanding_cost if demanding & set(action) else s.other_cost for action in study.scoring.actions]
    values = _reachable(study, set(costs))
    up = _nearest(values, np.minimum(values + s.recovery, s.max))
    down = np.stack([_nearest(values, np.maximum(values - cost, s.min)) for cost in costs])
    return Battery(values, up, down, (values >= s.threshold - MARGIN).astype(np.int64))


def _reachable(study: Study, costs: set[float]) -> Floats:
    s = study.capacity
    found = {round(s.start, 9)}
    queue = list(found)
    for value in queue:
        for after in [min(value + s.recovery, s.max), *(max(value - cost, s.min) for cost in sorted(costs))]:
            if round(after, 9) not in found:
                found.add(round(after, 9))
                queue.append(round(after, 9))
        if len(found) > MOST_LEVELS:
            return np.linspace(s.min, s.max, MOST_LEVELS)
    return np.array(sorted(found))


def _nearest(values: Floats, wanted: Floats) -> Ints:
    nearest: Ints = np.abs(values - wanted[:, None]).argmin(axis=1)
    return nearest


def level_of(battery: Battery, capacity: Floats, high: Ints) -> Ints:
    """The lattice value nearest to the tracked ``capacity`` among those of the class that was observed, [runs]."""
    distance = np.abs(battery.values - capacity[:, None]) + 1e6 * (battery.high != high[:, None])
    nearest: Ints = distance.argmin(axis=1)
    return nearest


def ahead(battery: Battery, chance: Floats, turns: Floats, share: Floats, depth: int, discount: float) -> Floats:
    """What an outcome is worth beyond its reward.

    Parameters
    ----------
    chance
        Probability of success, [actions, 2, 3, 5, runs].
    turns
        Probability of the next gaze class, [now, next, runs].
    share
        Of successes among results lately, [runs].
    depth
        Interactions to look ahead beyond this one.

    Returns
    -------
    [actions, capacity after, gaze now, outcome (failure, success), runs].
    """
    p = np.ascontiguousarray(chance[:, battery.high][:, :, :, OUTCOMES])
    gain = 2 * p - 1
    value = np.zeros_like(p)
    for _ in range(depth):
        best = _best(_chosen(battery, p, gain, value, discount))
        met = SAME_TASK * best + (1 - SAME_TASK) * _lately(best, share)
        parts = [turns[:, g, None] * met[:, :, g, None] for g in range(3)]
        value = parts[0] + parts[1] + parts[2]
    return value


def _lately(best: Floats, share: Floats) -> Floats:
    """The value with an awareness as results were lately, [actions, capacity, gaze, 1, runs]."""
    failed = best[:, :, :, :1]
    return failed + share * (best[:, :, :, 1:] - failed)


def _chosen(battery: Battery, p: Floats, gain: Floats, value: Floats, discount: float) -> tuple[Floats, Floats]:
    """The value of each action when it repeats the one before, and when it does not."""
    actions = np.arange(len(p))[:, None]
    found = []
    for then in (value[:, battery.repeated], value[actions, battery.executed]):
        failed = then[:, :, :, :1]
        found.append(gain + discount * (failed + p * (then[:, :, :, 1:] - failed)))
    return found[0], found[1]


def _best(chosen: tuple[Floats, Floats]) -> Floats:
    """The best value after each previous action: to repeat it, or any other."""
    repeated, other = chosen
    best, last = repeated.copy(), len(repeated) - 1
    below, above = other[0], other[last]
    for action in range(1, last + 1):
        np.maximum(best[action], below, out=best[action])
        np.maximum(best[last - action], above, out=best[last - action])
        below, above = np.maximum(below, other[action]), np.maximum(above, other[last - action])
    return best


def action_values(
    battery: Battery, chance: Floats, value: Floats, level: Ints, previous: Ints, triple: Ints, discount: float
) -> Floats:
    """The value of each action at a triple, [runs, actions].

    ``level`` is the lattice index of the capacity before the action, ``previous`` the action before it or -1;
    all [runs], as are the runs of ``chance`` and ``value``, as :func:`ahead` takes and gives them.
    """
    runs = np.arange(len(triple))
    actions = np.arange(len(chance))[:, None]
    after = np.where(actions == previous, battery.repeated[level], battery.executed[:, level])
    p = chance[actions, triple // 15, triple // 5 % 3, triple % 5, runs]
    failed, succeeded = (value[actions, after, triple // 5 % 3, outcome, runs] for outcome in (0, 1))
    values: Floats = 2 * p - 1 + discount * (failed + p * (succeeded - failed))
    return values.T
