"""The paper's second experiment: users A to D with and without the scoring prior (section V-B)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from shift_learner.learner import Context
from shift_study.study import Study

from shift_simulator.batched_learners import BatchQLearning
from shift_simulator.batched_sessions import simulate
from shift_simulator.criterion import users_criterion
from shift_simulator.random_streams import Floats, session_seeds
from shift_simulator.table2 import EPISODES, RUNS
from shift_simulator.users import PAPER_USERS, paper_user


def users(seed: int, runs: int = RUNS) -> dict[str, Any]:
    """Crossing and reward per user, with and without the prior, the curves and the criterion.

    ``curves`` holds what the figure shows, per user and prior: the mean cumulative reward after each episode,
    and the band between the 10th and 90th percentile of the runs.
    """
    rows, curves = [], []
    for name in PAPER_USERS:
        for prior, cumulative in _curves(name, seed, runs).items():
            rows.append({"user": name, "prior": prior} | _summary(cumulative))
            curves.append({"user": name, "prior": prior} | _curve(cumulative))
    return {"seed": seed, "runs": runs, "users": rows, "criterion": users_criterion(rows), "curves": curves}


def _curves(name: str, seed: int, runs: int) -> dict[bool, Floats]:
    """Cumulative reward with and without the prior, each [episodes, runs], on the same sessions."""
    study = Study(study="users")
    settings = study.learner
    prior = np.repeat([settings.prior_value, 0.0], runs)
    both = np.ones(2 * runs)
    learner = BatchQLearning(Context(study), prior, settings.learning_rate * both, settings.discount * both)
    found = simulate(paper_user(name), study, learner, session_seeds(seed, runs), EPISODES, 2).cumulative
    return {True: found[:, :runs], False: found[:, runs:]}


def crossing(cumulative: Floats) -> int | None:
    """Break-even of the mean curve: one after the last episode at or below 0, from 1; None if it ends there."""
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
    """Draw a panel per user, cumulative reward with and without the prior, as PNG and SVG."""
    from shift_simulator.figures import STYLES, draw_curve, finish, label_panels, on_one_scale, panels, saved

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
    return saved(figure, out_dir, "users")
