"""Counter-based random numbers of a simulated session: each has the address (session seed, n, stream).

Pure. ``simulated_person`` (one run) and ``batched_sessions`` (many) read the same addresses, so they get the same
numbers. The decider draws from stream 0; the person draws from the others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from shift_model.random_numbers import DECISION, uniform

TASK, GAZE_KEPT, GAZE_CLASS, DEVIATES, COIN, SUCCESS, T_COMPREHENSION, T_ENABLEDNESS, SESSION = range(1, 10)
"""Streams of the person; the last makes the session seeds of an experiment."""

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


def session_seed(seed: int, run: int) -> int:
    """Return the seed of run ``run`` (from 0) of an experiment with seed ``seed``: 53 bits at (seed, run, SESSION)."""
    return int(uniform(seed, run, SESSION) * 2**53)


def session_seeds(seed: int, runs: int) -> Ints:
    """Return :func:`session_seed` of runs 0, 1, ..., int [runs]."""
    numbers = uniform(np.full(runs, seed, dtype=np.uint64), np.arange(runs), SESSION)
    return (numbers * 2**53).astype(np.int64)


def index(u: Floats, n: int) -> Ints:
    """Return which of ``n`` equal parts of [0, 1) each draw falls into."""
    return (u * n).astype(np.int64)


@dataclass(frozen=True)
class Draws:
    """Uniform random numbers of many sessions, each float [episodes, runs]."""

    decision: Floats
    task: Floats
    gaze_kept: Floats
    gaze_class: Floats
    deviates: Floats
    coin: Floats
    success: Floats
    t_comprehension: Floats
    t_enabledness: Floats


def draws_of(seeds: Ints, episodes: int, copies: int = 1) -> Draws:
    """Return the random numbers of sessions with these seeds, n = 1 .. ``episodes``.

    ``copies`` repeats the runs side by side, so that the rows of a table get the same numbers and can be compared in
    pairs.
    """
    numbers = np.arange(1, episodes + 1)[:, None]
    streams = (DECISION, TASK, GAZE_KEPT, GAZE_CLASS, DEVIATES, COIN, SUCCESS, T_COMPREHENSION, T_ENABLEDNESS)
    return Draws(*(np.tile(uniform(seeds[None, :], numbers, stream), copies) for stream in streams))
