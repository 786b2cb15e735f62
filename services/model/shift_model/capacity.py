"""Processing capacity: the paper's case equation, its costs and its classes (paper, section III-A1, equation C').

Pure. Scalars and numpy arrays give the same bits. The scalar path does not need numpy.
"""

from __future__ import annotations

from collections.abc import Container, Iterable
from typing import TYPE_CHECKING, Any, overload

from shift_model.arrays import is_array
from shift_model.thresholds import reaches
from shift_model.vocabulary import CapacityClass

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@overload
def next_capacity(
    value: float, repeated: bool, cost: float, *, recovery: float, minimum: float, maximum: float
) -> float: ...
@overload
def next_capacity(
    value: NDArray[Any], repeated: Any, cost: Any, *, recovery: float, minimum: float, maximum: float
) -> NDArray[np.float64]: ...
def next_capacity(value: Any, repeated: Any, cost: Any, *, recovery: float, minimum: float, maximum: float) -> Any:
    """Return the capacity C' after one executed strategy (paper, section III-A1).

    Parameters
    ----------
    value
        The capacity C before it: a number, or an array of numbers.
    repeated
        Whether the strategy is the one before (A' = A, all levels): a bool, or an array that broadcasts.
    cost
        The strategy's cost, as :func:`strategy_cost` returns it: a number, or an array that broadcasts.
    recovery
        What a repeated strategy adds (delta_rep).
    minimum, maximum
        The floor and the cap (C_min, C_max).
    """
    if is_array(value):
        import numpy as np

        recovered = np.minimum(value + recovery, maximum)
        return np.where(repeated, recovered, np.maximum(value - cost, minimum))
    return min(value + recovery, maximum) if repeated else max(value - cost, minimum)


def strategy_cost(levels: Iterable[str], demanding: Container[str], demanding_cost: float, other_cost: float) -> float:
    """Return what a strategy costs (paper, section III-A1).

    Parameters
    ----------
    levels
        The strategy's levels.
    demanding
        The levels that make a strategy cognitively demanding; one of them is enough.
    demanding_cost, other_cost
        The costs of a demanding strategy (delta_cog) and of any other (delta_ncog).
    """
    for level in levels:
        if level in demanding:
            return demanding_cost
    return other_cost


@overload
def is_high(value: float, threshold: float) -> bool: ...
@overload
def is_high(value: NDArray[Any], threshold: float) -> NDArray[np.bool_]: ...
def is_high(value: Any, threshold: float) -> Any:
    """Return whether the capacity is of the class *high* (paper, section III-A1): a bool, or an array of them."""
    return reaches(value, threshold)


def capacity_class(value: float, threshold: float) -> CapacityClass:
    """Return the class of the capacity: *high* at or above the threshold (paper, section III-A1)."""
    return "high" if reaches(value, threshold) else "low"
