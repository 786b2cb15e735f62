"""The reward function (paper, section III-E, equations TP_score and R).

Pure. Scalars and numpy arrays give the same bits. The scalar path does not need numpy.
"""

from __future__ import annotations

from math import exp
from typing import TYPE_CHECKING, Any, overload

from shift_model.arrays import is_array

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@overload
def task_performance(success: bool, duration_s: float, decay: float) -> float: ...
@overload
def task_performance(success: Any, duration_s: NDArray[Any], decay: float) -> NDArray[np.float64]: ...
def task_performance(success: Any, duration_s: Any, decay: float) -> Any:
    """Return TP = success (+1 or -1) x exp(-k T).

    Parameters
    ----------
    success
        Whether the task succeeded in this dimension: a bool, or an array of them that broadcasts.
    duration_s
        T in seconds: a number, or an array of numbers.
    decay
        k in 1/s.
    """
    if is_array(duration_s):
        import numpy as np

        exp_each = np.frompyfunc(exp, 1, 1)  # numpy.exp can differ from math.exp in the last bit
        return np.where(success, 1.0, -1.0) * np.asarray(exp_each(-decay * duration_s), np.float64)
    return (1.0 if success else -1.0) * exp(-decay * duration_s)


@overload
def reward(comprehension: float, enabledness: float, scale: float) -> float: ...
@overload
def reward(comprehension: NDArray[Any], enabledness: NDArray[Any], scale: float) -> NDArray[np.float64]: ...
def reward(comprehension: Any, enabledness: Any, scale: float) -> Any:
    """Return R = scale (lambda) x the mean of the task performances of both dimensions."""
    return scale * ((comprehension + enabledness) / 2)
