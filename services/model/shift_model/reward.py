"""The reward function (paper, section III-E). Pure."""

from __future__ import annotations

from math import exp


def task_performance(success: bool, duration_s: float, decay: float) -> float:
    """Return TP = success (+1 or -1) x exp(-k T); T is ``duration_s`` in seconds, k is ``decay`` in 1/s."""
    return (1.0 if success else -1.0) * exp(-decay * duration_s)


def reward(comprehension: float, enabledness: float, scale: float) -> float:
    """Return R = scale (lambda) x the mean of the task performances of both dimensions."""
    return scale * ((comprehension + enabledness) / 2)
