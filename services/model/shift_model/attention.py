"""Attention weights, focus shift and the gaze class (paper, section III-A2, equations w' and FS').

Pure; plain numbers only, since every tracker's sample passes through these functions. The paper applies its
equations once per step; here a step's change is a parameter, so that a caller may apply them in proportion to dwell.
"""

from __future__ import annotations

from shift_model.thresholds import at_most, below, reaches
from shift_model.vocabulary import GazeClass

TOTAL = 1.0
"""The sum of all weights, the paper's C_max = sum of w_i; chosen."""

SHIFT_MAX = 1.0
"""The cap of the focus shift, FS_max; chosen."""

SHIFT_MIN = 0.0
"""The floor of the focus shift, FS_min; chosen."""


def uniform_weights(targets: int) -> tuple[float, ...]:
    """Return equal weights that sum to ``TOTAL``."""
    return (TOTAL / targets,) * targets


def next_weights(weights: tuple[float, ...], target: int, gain: float, weight_min: float) -> tuple[float, ...]:
    """Return the weights w' after gaze on ``target`` (an index), including the case that the paper leaves open.

    The fixated target gains ``gain`` (delta_w), at most up to ``TOTAL``, in equal parts from the others. One that
    reaches ``weight_min`` gives no more and the rest is taken from those above it. The fixated target gets what
    the others leave, so the sum cannot drift. A single target keeps everything.
    """
    after = list(weights)
    after[target] = weight_min  # the target itself gives nothing
    givers = [i for i, w in enumerate(after) if w > weight_min]
    while givers and gain > 0.0:
        least = min([after[i] for i in givers]) - weight_min
        part = gain / len(givers)
        if part < least:
            for i in givers:
                after[i] -= part
            break
        gain -= least * len(givers)
        for i in givers:
            after[i] = max(after[i] - least, weight_min)
        givers = [i for i in givers if after[i] > weight_min]
    after[target] = 0.0
    after[target] = TOTAL - sum(after)
    return tuple(after)


def raised_focus_shift(shift: float, increase: float) -> float:
    """Return the focus shift FS' after a change of the focused target; ``increase`` is delta_inc."""
    return min(shift + increase, SHIFT_MAX)


def lowered_focus_shift(shift: float, decrease: float) -> float:
    """Return the focus shift FS' while the focused target is kept; ``decrease`` is delta_dec."""
    return max(shift - decrease, SHIFT_MIN)


def gaze_class(
    dominance: float,
    shift: float,
    *,
    focused_dominance: float,
    focused_shift: float,
    distracted_dominance: float,
    distracted_shift: float,
) -> GazeClass:
    """Return the gaze class by fixed thresholds (paper, section III-A2; the thresholds are chosen).

    ``dominance`` is the largest weight, ``shift`` the focus shift. *Focused* needs both; either is enough for
    *distracted*; anything else is *uncertain*.
    """
    if reaches(dominance, focused_dominance) and at_most(shift, focused_shift):
        return "focused"
    if below(dominance, distracted_dominance) or reaches(shift, distracted_shift):
        return "distracted"
    return "uncertain"
