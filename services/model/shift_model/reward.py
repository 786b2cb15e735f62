"""The reward function (paper, section III-E). Pure."""

from __future__ import annotations

from math import exp

from shift_schemas.messages import Result, ScoredResult
from shift_schemas.study import RewardSettings


def task_performance(result: Result, settings: RewardSettings) -> ScoredResult:
    """TP = success (+1 or -1) x exp(-k T), T in seconds."""
    value = (1.0 if result.success else -1.0) * exp(-settings.decay * result.duration_s)
    return ScoredResult(success=result.success, duration_s=result.duration_s, value=value)


def reward(comprehension: float, enabledness: float, settings: RewardSettings) -> float:
    """R = λ x the mean of both dimensions' task performance."""
    return settings.scale * ((comprehension + enabledness) / 2)
