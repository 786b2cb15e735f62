"""The probability that each of several independent samples is the largest, by quadrature. Pure, deterministic.

P(i) = integral of f_i(x) x product over j != i of F_j(x): the exact choice probabilities of Thompson sampling.
All densities are on one grid; the distribution functions are their running integrals (trapezoid rule). The row is
normalised, and the decider draws from this row, so the published probabilities are the actual ones.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def chances_of_largest(densities: Floats) -> list[float]:
    """Return the probability of each arm, [arms], summing to 1.

    ``densities`` is [arms, points] on an even grid; each row may have any factor.
    """
    steps = (densities[:, 1:] + densities[:, :-1]) / 2
    below = np.concatenate([np.zeros((len(densities), 1)), np.cumsum(steps, axis=1)], axis=1)
    below /= below[:, -1:]
    others = _product_of_others(below)
    chances = (np.diff(below, axis=1) * (others[:, 1:] + others[:, :-1])).sum(axis=1)
    row: list[float] = (chances / chances.sum()).tolist()
    return row


def _product_of_others(below: Floats) -> Floats:
    """Return for each arm the product of all other arms' rows, without division, since rows begin with 0."""
    product = np.ones_like(below)
    np.cumprod(below[:-1], axis=0, out=product[1:])
    after = np.cumprod(below[:0:-1], axis=0)[::-1]
    product[:-1] *= after
    return product
