"""The scoring system H_S and its ranking (paper, section III-C, Table I and equation Scaffolding_score).

Pure. Scalars and numpy arrays give the same ranks. The scalar path does not need numpy.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, overload

from shift_model.arrays import is_array
from shift_model.thresholds import reaches

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@overload
def scaffolding_score(entries: Iterable[float], weight: float, s_max: float) -> float: ...
@overload
def scaffolding_score(entries: NDArray[Any], weight: float, s_max: float) -> NDArray[np.float64]: ...
def scaffolding_score(entries: Any, weight: float, s_max: float) -> Any:
    """Return a strategy's score: ``weight`` x the sum of the table's entries / ``s_max``.

    Parameters
    ----------
    entries
        The table's entries for one observation each; an array is summed over its last axis.
    weight
        The scaffolding factor S_weight.
    s_max
        The largest sum S_max.
    """
    if is_array(entries):
        return weight * entries.sum(axis=-1) / s_max
    return weight * sum(entries) / s_max


@overload
def level_index(score: float, thresholds: Sequence[float]) -> int: ...
@overload
def level_index(score: NDArray[Any], thresholds: Sequence[float]) -> NDArray[np.int64]: ...
def level_index(score: Any, thresholds: Sequence[float]) -> Any:
    """Return the index of the level that a score is ranked into: how many of the rising thresholds it reaches."""
    if is_array(score):
        import numpy as np

        return reaches(score[..., None], np.array(thresholds)).sum(axis=-1)
    return sum(reaches(score, threshold) for threshold in thresholds)


@overload
def action_index(levels: Iterable[int], counts: Iterable[int]) -> int: ...
@overload
def action_index(levels: Iterable[NDArray[Any]], counts: Iterable[int]) -> NDArray[np.int64]: ...
def action_index(levels: Any, counts: Any) -> Any:
    """Return the index of the action that has these levels (paper, section III-B: the product of the levels).

    Parameters
    ----------
    levels
        The index of the level of each strategy; the last strategy varies first.
    counts
        How many levels each strategy has.
    """
    action = 0
    for level, count in zip(levels, counts, strict=True):
        action = action * count + level
    return action
