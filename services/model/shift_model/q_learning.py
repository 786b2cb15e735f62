"""Q-learning and the decay of epsilon (paper, section III-D; Watkins & Dayan 1992; Tokic 2010).

Pure. Scalars and numpy arrays give the same bits. The functions do not need numpy.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, overload

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@overload
def updated_value(value: float, reward: float, best_next: float, *, learning_rate: float, discount: float) -> float: ...
@overload
def updated_value(
    value: NDArray[Any], reward: Any, best_next: Any, *, learning_rate: Any, discount: Any
) -> NDArray[np.float64]: ...
def updated_value(value: Any, reward: Any, best_next: Any, *, learning_rate: Any, discount: Any) -> Any:
    """Return Q(s, a) after one step towards the target r + gamma x max Q(s').

    Parameters
    ----------
    value
        Q(s, a).
    reward
        r.
    best_next
        max Q(s'), or 0 if there is no next state.
    learning_rate, discount
        alpha and gamma.
    """
    return value + learning_rate * (reward + discount * best_next - value)


def decayed_epsilon(epsilon: float, decisions: int, interactions: int) -> float:
    """Return the probability of exploring, which falls linearly from ``epsilon`` to 0.

    Parameters
    ----------
    epsilon
        The probability at the first decision.
    decisions
        The number of decisions made so far.
    interactions
        The planned number of interactions, after which the probability is 0.
    """
    return epsilon * max(0.0, 1.0 - decisions / interactions)
