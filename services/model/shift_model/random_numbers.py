"""Counter-based random numbers: a draw depends on its address ``(seed, n, stream)`` alone; no state is consumed. Pure.

A restart changes no draw, and the draws of many runs can be made at once. The generator is SplitMix64 (Steele, Lea,
Flood 2014, "Fast splittable pseudorandom number generators"): three rounds of its finalizer mix the address into 64
bits; the upper 53 of them are the number. Scalars and numpy arrays give the same bits.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, overload

from shift_model.arrays import is_array

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_MASK = (1 << 64) - 1
_GAMMA = 0x9E3779B97F4A7C15
_A = 0xBF58476D1CE4E5B9
_B = 0x94D049BB133111EB
_UNIT = 2.0**-53

DECISION = 0
"""The stream of the decider's draws; the simulator has other streams."""


@overload
def uniform(seed: int, n: int, stream: int = DECISION) -> float: ...
@overload
def uniform(seed: NDArray[Any], n: Any, stream: int = DECISION) -> NDArray[np.float64]: ...
def uniform(seed: Any, n: Any, stream: int = DECISION) -> Any:
    """Return the number in [0, 1) of an address.

    Parameters
    ----------
    seed, n
        Integers, or arrays of them that broadcast (0 <= seed < 2**53).
    stream
        The index of one of several independent numbers at the same (seed, n).
    """
    if is_array(seed) or is_array(n):
        import numpy as np

        h = _mix_array(np.asarray(seed, dtype=np.uint64))
        h = _mix_array(h ^ np.asarray(n, dtype=np.uint64))
        h = _mix_array(h ^ np.uint64(stream))
        return (h >> np.uint64(11)).astype(np.float64) * _UNIT
    return (_mix(_mix(_mix(seed) ^ n) ^ stream) >> 11) * _UNIT


def pick(probabilities: list[float], u: float) -> int:
    """Return the index at which the running sum of ``probabilities`` first exceeds ``u``.

    Rounding can leave the whole sum below ``u``; then return the last index with any probability.
    """
    total = 0.0
    last = 0
    for i, p in enumerate(probabilities):
        total += p
        if p > 0:
            last = i
            if u < total:
                return i
    return last


def _mix(z: int) -> int:
    z = (z + _GAMMA) & _MASK
    z = ((z ^ (z >> 30)) * _A) & _MASK
    z = ((z ^ (z >> 27)) * _B) & _MASK
    return z ^ (z >> 31)


def _mix_array(z: NDArray[np.uint64]) -> NDArray[np.uint64]:
    import numpy as np

    with np.errstate(over="ignore"):
        z = z + np.uint64(_GAMMA)
        z = (z ^ (z >> np.uint64(30))) * np.uint64(_A)
        z = (z ^ (z >> np.uint64(27))) * np.uint64(_B)
        return z ^ (z >> np.uint64(31))
