"""Comparisons with a threshold (paper, sections III-A and III-C: "absolute thresholds", "threshold-based ranking").

Every class and every rank of the model is decided by these functions. Scalars and numpy arrays give the same
answers; both may be mixed and broadcast. A scalar costs one addition and one comparison.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, overload

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

MARGIN = 1e-9
"""Chosen: a value this close to a threshold equals it. Values are sums of tenths and thirds, and rounding must not
move such a sum to the other side of a threshold (docs/model.md)."""


@overload
def reaches(value: float, threshold: float) -> bool: ...
@overload
def reaches(value: NDArray[Any], threshold: Any) -> NDArray[np.bool_]: ...
@overload
def reaches(value: float, threshold: NDArray[Any]) -> NDArray[np.bool_]: ...
def reaches(value: Any, threshold: Any) -> Any:
    """Return whether ``value`` is at the threshold or above it."""
    return value >= threshold - MARGIN


@overload
def below(value: float, threshold: float) -> bool: ...
@overload
def below(value: NDArray[Any], threshold: Any) -> NDArray[np.bool_]: ...
@overload
def below(value: float, threshold: NDArray[Any]) -> NDArray[np.bool_]: ...
def below(value: Any, threshold: Any) -> Any:
    """Return whether ``value`` is below the threshold: the opposite of :func:`reaches`."""
    return value < threshold - MARGIN


@overload
def at_most(value: float, threshold: float) -> bool: ...
@overload
def at_most(value: NDArray[Any], threshold: Any) -> NDArray[np.bool_]: ...
@overload
def at_most(value: float, threshold: NDArray[Any]) -> NDArray[np.bool_]: ...
def at_most(value: Any, threshold: Any) -> Any:
    """Return whether ``value`` is at the threshold or below it."""
    return value <= threshold + MARGIN
