"""The look-ahead: value iteration over the model's own capacity equation (Bellman 1957). Pure.

Arrays end with an axis of runs. A state is capacity x previous action x gaze class x awareness. Capacity moves by the
study's equation, and gaze by the transitions that were observed. Awareness follows outcomes: the next interaction
has the result of this one with probability ``SAME_TASK``, else a result like the recent ones. The reward is +1 for a
success and -1 for a failure: the duration of a task does not depend on the action here.
"""

from __future__ import annotations

import numpy as np
from shift_model.vocabulary import AWARENESSES

from shift_learner.learners.planning.capacity_model import CapacityModel
from shift_learner.learners.planning.plausible import Floats, Ints

SAME_TASK = 0.6
"""Chosen: more than one in three, the chance that the next task is this one, since a later task may meet this result
as well. Between 0.33 and 1 the reward of a planner that knows the person does not change."""
OUTCOMES = (AWARENESSES.index("failure"), AWARENESSES.index("success"))


def outcome_values(
    model: CapacityModel, chance: Floats, transitions: Floats, share: Floats, depth: int, discount: float
) -> Floats:
    """Return the value of each outcome beyond its reward.

    Parameters
    ----------
    chance
        Probability of success, [actions, 2, 3, 5, runs].
    transitions
        Probability of the next gaze class, [now, next, runs].
    share
        Share of successes among recent results, [runs].
    depth
        Number of interactions to look ahead beyond this one.

    Returns
    -------
    [actions, capacity after, gaze now, outcome (failure, success), runs].
    """
    p = np.ascontiguousarray(chance[:, model.high][:, :, :, OUTCOMES])
    gain = 2 * p - 1
    value = np.zeros_like(p)
    for _ in range(depth):
        best = _best_values(_choice_values(model, p, gain, value, discount))
        met = SAME_TASK * best + (1 - SAME_TASK) * _recent_value(best, share)
        parts = [transitions[:, g, None] * met[:, :, g, None] for g in range(3)]
        value = parts[0] + parts[1] + parts[2]
    return value


def action_values(
    model: CapacityModel, chance: Floats, value: Floats, level: Ints, previous: Ints, triple: Ints, discount: float
) -> Floats:
    """Return the value of each action at a triple, [runs, actions].

    Parameters
    ----------
    chance, value
        As :func:`outcome_values` takes and returns them, for these runs.
    level
        Lattice index of the capacity before the action, [runs].
    previous
        The action before, or -1, [runs].
    triple
        Index of the triple, [runs].
    """
    runs = np.arange(len(triple))
    actions = np.arange(len(chance))[:, None]
    after = np.where(actions == previous, model.repeated[level], model.executed[:, level])
    p = chance[actions, triple // 15, triple // 5 % 3, triple % 5, runs]
    failed, succeeded = (value[actions, after, triple // 5 % 3, outcome, runs] for outcome in (0, 1))
    values: Floats = 2 * p - 1 + discount * (failed + p * (succeeded - failed))
    return values.T


def _recent_value(best: Floats, share: Floats) -> Floats:
    """Return the value at an awareness like recent results, [actions, capacity, gaze, 1, runs]."""
    failed = best[:, :, :, :1]
    return failed + share * (best[:, :, :, 1:] - failed)


def _choice_values(
    model: CapacityModel, p: Floats, gain: Floats, value: Floats, discount: float
) -> tuple[Floats, Floats]:
    """Return the value of each action if it repeats the one before, and if it does not."""
    actions = np.arange(len(p))[:, None]
    found = []
    for then in (value[:, model.repeated], value[actions, model.executed]):
        failed = then[:, :, :, :1]
        found.append(gain + discount * (failed + p * (then[:, :, :, 1:] - failed)))
    return found[0], found[1]


def _best_values(choices: tuple[Floats, Floats]) -> Floats:
    """Return the best value after each previous action: of its repetition and of all other actions."""
    repeated, other = choices
    best, last = repeated.copy(), len(repeated) - 1
    below, above = other[0], other[last]
    for action in range(1, last + 1):
        np.maximum(best[action], below, out=best[action])
        np.maximum(best[last - action], above, out=best[last - action])
        below, above = np.maximum(below, other[action]), np.maximum(above, other[last - action])
    return best
