"""Every random number of a simulated session, by its address (session seed, n, stream).

Pure. One run at a time (``people``) and many at once (``dynamics``) read the same addresses, so they meet the
same luck. Stream 0 is the decider's own draw; the others are the person's.
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
    """The seed of run ``run`` (from 0) of an experiment with seed ``seed``: 53 bits at (seed, run, SESSION)."""
    return int(uniform(seed, run, SESSION) * 2**53)


def session_seeds(seed: int, runs: int) -> Ints:
    """:func:`session_seed` of runs 0, 1, ..., int [runs]."""
    numbers = uniform(np.full(runs, seed, dtype=np.uint64), np.arange(runs), SESSION)
    return (numbers * 2**53).astype(np.int64)


def index(u: Floats, n: int) -> Ints:
    """Which of ``n`` equal parts of [0, 1) each draw falls into."""
    return (u * n).astype(np.int64)


@dataclass(frozen=True)
class Draws:
    """Draws of many sessions as uniform numbers, each float [episodes, runs]."""

    decision: Floats
    task: Floats
    gaze_kept: Floats
    gaze_class: Floats
    deviates: Floats
    coin: Floats
    success: Floats
    t_comprehension: Floats
    t_enabledness: Floats


def drawn(seeds: Ints, episodes: int, copies: int = 1) -> Draws:
    """The draws of sessions with these seeds, n = 1 .. ``episodes``.

    ``copies`` repeats the runs side by side: the rows of a table then meet the same luck, and are compared pairwise.
    """
    numbers = np.arange(1, episodes + 1)[:, None]
    streams = (DECISION, TASK, GAZE_KEPT, GAZE_CLASS, DEVIATES, COIN, SUCCESS, T_COMPREHENSION, T_ENABLEDNESS)
    return Draws(*(np.tile(uniform(seeds[None, :], numbers, stream), copies) for stream in streams))
