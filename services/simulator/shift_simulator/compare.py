"""The comparison of learners: reward, break-even, regret and worst dip, with standard errors."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from shift_learner.learner import Context
from shift_recording.parallel import for_each
from shift_study.study import Study

from shift_simulator.batched_learners import batch_learner
from shift_simulator.batched_sessions import simulate
from shift_simulator.optimum import optimum
from shift_simulator.random_streams import Floats, session_seeds
from shift_simulator.table2 import EPISODES
from shift_simulator.user_study import crossing
from shift_simulator.users import User

OnProgress = Callable[[str], None]
INTERVAL = 1.96
"""Half the width of a 95 % interval, in standard errors of a normal distribution."""


def compare(
    names: Sequence[str], people: Sequence[User], seed: int, runs: int, regret: bool, report_progress: OnProgress,
    workers: int = 1, scheduler: str = "",
) -> dict[str, Any]:  # fmt: skip
    """Return the results of every learner with every user on the same sessions (docs/interface.md, "Command line").

    ``regret_mean`` is the exact optimum of the user (``optimum``) minus the mean reward, or None without ``regret``.
    Its standard error is that of the reward. ``reward_low`` and ``reward_high`` are the 10th and the 90th percentile
    of the runs. ``curves`` holds the mean cumulative reward after each episode, with the ends ``low`` and ``high`` of
    its 95 % interval. Each pair of learner and user can be simulated in a process of its own.
    """
    pairs = [(name, user) for user in people for name in names]
    simulated = for_each(partial(_rewards_of_pair, seed=seed, runs=runs), pairs, workers, scheduler)
    results, curves = [], []
    for user in people:
        best = optimum(user, Study(study="learners"), EPISODES) if regret else None
        for name in names:
            report_progress(f"{name} with user {user.user}")
            cumulative = next(simulated)
            results.append({"learner": name, "user": user.user} | _summary(cumulative, best))
            curves.append({"learner": name, "user": user.user} | _curve(cumulative))
    return {"seed": seed, "runs": runs, "results": results, "curves": curves}


def _rewards_of_pair(pair: tuple[str, User], seed: int, runs: int) -> Floats:
    return rewards_of(*pair, seed, runs)


def rewards_of(name: str, user: User, seed: int, runs: int, episodes: int = EPISODES) -> Floats:
    """Return the cumulative reward [episodes, runs] of a learner with its default settings."""
    study = Study.model_validate({"study": "learners", "learner": {"name": name}})
    learner = batch_learner(Context(study), runs)
    return simulate(user, study, learner, session_seeds(seed, runs), episodes).cumulative


def _summary(cumulative: Floats, best: float | None) -> dict[str, Any]:
    reward, dip = cumulative[-1], cumulative.min(axis=0)
    return {
        "reward_mean": float(reward.mean()),
        "reward_se": _error(reward),
        "reward_low": float(np.percentile(reward, 10)),
        "reward_high": float(np.percentile(reward, 90)),
        "break_even": crossing(cumulative),
        "regret_mean": None if best is None else best - float(reward.mean()),
        "worst_dip": float(dip.mean()),
        "worst_dip_se": _error(dip),
    }


def _error(values: Floats) -> float:
    return float(values.std(ddof=1) / np.sqrt(len(values))) if len(values) > 1 else 0.0


def _curve(cumulative: Floats) -> dict[str, Any]:
    mean = cumulative.mean(axis=1)
    half = INTERVAL * np.array([_error(values) for values in cumulative])
    return {"mean": mean.tolist(), "low": (mean - half).tolist(), "high": (mean + half).tolist()}


def draw_learners(result: dict[str, Any], out_dir: Path) -> list[Path]:
    """Draw two panels for each user, as PNG and SVG: mean curves, and final rewards with the spread of the runs.

    Curves of similar learners coincide in the first panel. In the second panel each learner has its own line.
    """
    from shift_simulator.figures import STYLES, draw_curve, finish, label_panels, on_one_scale, panels, save_figure

    users = list(dict.fromkeys(c["user"] for c in result["curves"]))
    learners = list(dict.fromkeys(c["learner"] for c in result["curves"]))
    figure, (over_time, at_the_end) = panels(len(users), 1.9, 1.45)
    on_one_scale(at_the_end)
    for user, above, below in zip(users, over_time, at_the_end, strict=True):
        for curve in (c for c in result["curves"] if c["user"] == user):
            turn = learners.index(curve["learner"])
            draw_curve(above, curve, STYLES[turn % len(STYLES)], turn, len(learners), curve["learner"])
        for row in (r for r in result["results"] if r["user"] == user):
            place = learners.index(row["learner"])
            _draw_end(below, row, STYLES[place % len(STYLES)], place)
        above.axhline(0, color="black", linewidth=0.5)
        below.axvline(0, color="black", linewidth=0.5)
    at_the_end[0].set_yticks(range(len(learners)), learners)
    at_the_end[0].set_ylim(len(learners) - 0.5, -0.5)
    episodes = len(result["curves"][0]["mean"])
    label_panels(over_time, users, "episode", "cumulative reward")
    label_panels(at_the_end, users, f"reward after {episodes}", "")
    finish(
        figure,
        over_time[0],
        f"Means of n = {result['runs']} simulated runs (seed {result['seed']}). Above, over time, each user on a scale "
        f"of its own; band: 95 % interval of the mean (± {INTERVAL} standard errors). Below: reward after {episodes} "
        "episodes; bar: the middle 80 % of the runs (10th to 90th percentile).",
    )
    return save_figure(figure, out_dir, "learners")


def _draw_end(ax: Any, row: dict[str, Any], style: Any, place: int) -> None:
    mean, low, high = (row[name] for name in ("reward_mean", "reward_low", "reward_high"))
    ax.hlines(place, low, high, color=style.colour, linewidth=1.2)
    ax.plot(
        mean, place, color=style.colour, marker=style.marker, linestyle="none",
        markerfacecolor="white" if style.marker != "x" else None,
    )  # fmt: skip
