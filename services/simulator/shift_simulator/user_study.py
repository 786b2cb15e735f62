"""The paper's second experiment: users A to D with and without the scoring prior (section V-B)."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from shift_learner.learner import Context
from shift_recording.parallel import for_each
from shift_study.study import Study

from shift_simulator.batched_learners import BatchQLearning
from shift_simulator.batched_sessions import OnProgress, simulate
from shift_simulator.criterion import users_criterion
from shift_simulator.random_streams import Floats, session_seeds
from shift_simulator.table2 import EPISODES, RUNS
from shift_simulator.users import PAPER_USERS, paper_user


def users(
    seed: int, runs: int = RUNS, on_progress: OnProgress | None = None, workers: int = 1, scheduler: str = ""
) -> dict[str, Any]:
    """Return the break-even and reward of each user with and without the prior, the curves and the criterion.

    ``curves`` holds the data of the figure for each user and prior: the mean cumulative reward after each episode,
    and the band between the 10th and 90th percentile of the runs.
    """
    rows, curves = [], []
    simulated = for_each(partial(_curves, seed=seed, runs=runs), PAPER_USERS, workers, scheduler)
    for done, name in enumerate(PAPER_USERS):
        if on_progress is not None:
            on_progress(done, len(PAPER_USERS))
        for prior, cumulative in next(simulated).items():
            rows.append({"user": name, "prior": prior} | _summary(cumulative))
            curves.append({"user": name, "prior": prior} | _curve(cumulative))
    return {"seed": seed, "runs": runs, "users": rows, "criterion": users_criterion(rows), "curves": curves}


def _curves(name: str, seed: int, runs: int) -> dict[bool, Floats]:
    """Return the cumulative reward with and without the prior on the same sessions, each [episodes, runs]."""
    study = Study(study="users")
    settings = study.learner
    prior = np.repeat([settings.prior_value, 0.0], runs)
    ones = np.ones(2 * runs)
    learner = BatchQLearning(Context(study), prior, settings.learning_rate * ones, settings.discount * ones)
    cumulative = simulate(paper_user(name), study, learner, session_seeds(seed, runs), EPISODES, 2).cumulative
    return {True: cumulative[:, :runs], False: cumulative[:, runs:]}


def crossing(cumulative: Floats) -> int | None:
    """Return the break-even of the mean curve, or None if it ends at or below 0.

    It is the number (from 1) of the episode after the last one at or below 0.
    """
    below = np.flatnonzero(cumulative.mean(axis=1) <= 0)
    after = int(below[-1]) + 2 if len(below) else 1
    return after if after <= len(cumulative) else None


def _summary(cumulative: Floats) -> dict[str, Any]:
    reward = cumulative[-1]
    return {
        "crossing": crossing(cumulative),
        "reward_mean": float(reward.mean()),
        "reward_se": float(reward.std(ddof=1) / np.sqrt(len(reward))),
    }


def _curve(cumulative: Floats) -> dict[str, Any]:
    low, high = np.percentile(cumulative, [10, 90], axis=1)
    return {"mean": cumulative.mean(axis=1).tolist(), "low": low.tolist(), "high": high.tolist()}


def draw_users(result: dict[str, Any], out_dir: Path) -> list[Path]:
    """Draw the cumulative reward with and without the prior, one panel for each user, as PNG and SVG."""
    from shift_simulator.figures import STYLES, draw_curve, finish, label_panels, on_one_scale, panels, save_figure

    names = list(dict.fromkeys(c["user"] for c in result["curves"]))
    figure, (axes,) = panels(len(names), 1.6)
    on_one_scale(axes)
    for name, ax in zip(names, axes, strict=True):
        for curve in (c for c in result["curves"] if c["user"] == name):
            turn, label = (0, "with scoring prior") if curve["prior"] else (1, "without prior")
            draw_curve(ax, curve, STYLES[turn], turn, 2, label)
        ax.axhline(0, color="black", linewidth=0.5)
    label_panels(axes, names, "episode", "cumulative reward")
    runs, seed = result["runs"], result["seed"]
    finish(
        figure,
        axes[0],
        f"Line: mean of n = {runs} simulated runs (seed {seed}). Band: the middle 80 % of the runs (10th to 90th "
        "percentile).",
    )
    return save_figure(figure, out_dir, "users")
