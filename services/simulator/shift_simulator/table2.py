"""The paper's Table II, simulated: twelve settings of the Q-learner with user A (docs/model.md, section 5)."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from shift_learner.learner import Context
from shift_study.study import Study

from shift_simulator.batched_learners import BatchQLearning
from shift_simulator.batched_sessions import simulate
from shift_simulator.criterion import table2_criterion
from shift_simulator.random_streams import Floats, session_seeds
from shift_simulator.users import paper_user

EPISODES = 100
RUNS = 500


class Setting(NamedTuple):
    """A row of the paper's table: its parameters and its four numbers."""

    row: int
    prior: bool
    learning_rate: float
    discount: float
    z_mean: float
    z_sd: float
    r_mean: float
    r_sd: float


PAPER: tuple[Setting, ...] = (
    Setting(1, False, 0.25, 0.00, 31.78, 32.90, 13.39, 5.30),
    Setting(2, True, 0.25, 0.00, 13.99, 20.66, 19.62, 4.71),
    Setting(3, False, 0.25, 0.50, 32.82, 33.62, 12.87, 5.36),
    Setting(4, True, 0.25, 0.50, 13.18, 20.04, 19.98, 4.98),
    Setting(5, False, 0.25, 0.95, 31.94, 34.60, 9.82, 6.32),
    Setting(6, True, 0.25, 0.95, 15.25, 22.43, 19.07, 5.07),
    Setting(7, False, 0.50, 0.00, 33.91, 35.12, 12.11, 5.36),
    Setting(8, True, 0.50, 0.00, 14.10, 21.02, 18.33, 4.95),
    Setting(9, False, 0.50, 0.50, 31.76, 33.72, 12.86, 5.64),
    Setting(10, True, 0.50, 0.50, 13.47, 21.09, 18.77, 5.00),
    Setting(11, False, 0.50, 0.95, 34.03, 38.20, 7.26, 6.95),
    Setting(12, True, 0.50, 0.95, 14.92, 21.19, 18.73, 5.04),
)
"""Table II of the paper; epsilon is 0.75 in every row."""

MEASURES = ("z_mean", "z_sd", "r_mean", "r_sd")


def table2(seed: int, runs: int = RUNS) -> dict[str, Any]:
    """Return the twelve rows, the paper's values, and the verdict on the criterion (docs/interface.md, "Command line").

    All rows use the same ``runs`` simulated sessions, so they differ only by their settings.
    """
    cumulative = _cumulative(seed, runs)
    rows = [_row(setting, cumulative[:, i * runs : (i + 1) * runs]) for i, setting in enumerate(PAPER)]
    return {"seed": seed, "runs": runs, "rows": rows, "criterion": table2_criterion(rows)}


def _cumulative(seed: int, runs: int) -> Floats:
    """Return the cumulative reward of all rows side by side, float [episodes, 12 x runs]."""
    study = Study(study="table2")
    prior = np.repeat([study.learner.prior_value * s.prior for s in PAPER], runs)
    rate = np.repeat([s.learning_rate for s in PAPER], runs)
    discount = np.repeat([s.discount for s in PAPER], runs)
    learner = BatchQLearning(Context(study), prior, rate, discount)
    seeds = session_seeds(seed, runs)
    return simulate(paper_user("A"), study, learner, seeds, EPISODES, len(PAPER)).cumulative


def _row(setting: Setting, cumulative: Floats) -> dict[str, Any]:
    zero, reward = zero_crossings(cumulative), cumulative[-1]
    values = (zero.mean(), zero.std(ddof=1), reward.mean(), reward.std(ddof=1))
    return {
        "row": setting.row,
        "prior": setting.prior,
        "learning_rate": setting.learning_rate,
        "discount": setting.discount,
        **{key: float(value) for key, value in zip(MEASURES, values, strict=True)},
        "paper": {key: getattr(setting, key) for key in MEASURES},
    }


def zero_crossings(cumulative: Floats) -> Floats:
    """Return Z of each run: the first episode (from 0) with a cumulative reward above 0, or else their number."""
    above = cumulative > 0
    return np.where(above.any(axis=0), above.argmax(axis=0), len(cumulative)).astype(np.float64)
