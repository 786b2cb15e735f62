"""Learners compared on users: reward, break-even, regret and worst dip, with standard errors."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from shift_learner.learner import Context
from shift_schemas.study import Study

from shift_simulator.batch import batch_learner
from shift_simulator.draws import Floats, session_seeds
from shift_simulator.dynamics import simulate
from shift_simulator.optimum import optimum
from shift_simulator.table2 import EPISODES
from shift_simulator.user_study import crossing
from shift_simulator.users import User

Progress = Callable[[str], None]


def compare(
    names: Sequence[str], people: Sequence[User], seed: int, runs: int, regret: bool, said: Progress
) -> dict[str, Any]:
    """Every learner on every user, all on the same sessions (INTERFACE.md, "Command line").

    ``regret_mean`` is the exact optimum of the user (``optimum``) less the mean reward, else None; its standard
    error is the reward's. ``curves`` holds the mean cumulative reward after each episode.
    """
    results, curves = [], []
    for user in people:
        best = optimum(user, Study(study="learners"), EPISODES) if regret else None
        for name in names:
            said(f"{name} with user {user.user}")
            cumulative = rewards_of(name, user, seed, runs)
            results.append({"learner": name, "user": user.user} | _summary(cumulative, best))
            curves.append({"learner": name, "user": user.user, "mean": cumulative.mean(axis=1).tolist()})
    return {"seed": seed, "runs": runs, "results": results, "curves": curves}


def rewards_of(name: str, user: User, seed: int, runs: int, episodes: int = EPISODES) -> Floats:
    """Cumulative reward [episodes, runs] of a learner with its default settings."""
    study = Study.model_validate({"study": "learners", "learner": {"name": name}})
    learner = batch_learner(Context(study), runs)
    return simulate(user, study, learner, session_seeds(seed, runs), episodes).cumulative


def _summary(cumulative: Floats, best: float | None) -> dict[str, Any]:
    reward, dip = cumulative[-1], cumulative.min(axis=0)
    return {
        "reward_mean": float(reward.mean()),
        "reward_se": _error(reward),
        "break_even": crossing(cumulative),
        "regret_mean": None if best is None else best - float(reward.mean()),
        "worst_dip": float(dip.mean()),
        "worst_dip_se": _error(dip),
    }


def _error(values: Floats) -> float:
    return float(values.std(ddof=1) / np.sqrt(len(values))) if len(values) > 1 else 0.0


def draw_learners(result: dict[str, Any], out_dir: Path) -> list[Path]:
    """The figure: one panel per user, mean cumulative reward of each learner, as PNG and SVG."""
    from shift_simulator.figures import panels, saved

    names = list(dict.fromkeys(c["user"] for c in result["curves"]))
    figure, axes = panels(len(names), height=3.6)
    for name, ax in zip(names, axes, strict=True):
        for curve in (c for c in result["curves"] if c["user"] == name):
            ax.plot(np.arange(1, len(curve["mean"]) + 1), curve["mean"], label=curve["learner"], linewidth=1.2)
        ax.axhline(0, color="black", linewidth=0.7)
        ax.set_title(f"User {name}")
        ax.set_xlabel("episode")
    axes[0].set_ylabel("mean cumulative reward")
    axes[0].legend(frameon=False, loc="upper left", fontsize=7)
    return saved(figure, out_dir, "learners")
