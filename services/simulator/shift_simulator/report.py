"""Tables of the results, printed with rich. They show the values of the JSON document."""

from __future__ import annotations

from math import sqrt
from typing import Any

from rich.console import Console
from rich.table import Table

from shift_simulator.criterion import Point, passed


def print_table2(result: dict[str, Any], console: Console) -> None:
    """Print the twelve rows: value, standard error, difference from the paper."""
    title = f"Table II, user A, {result['runs']} runs, seed {result['seed']}: ours ± standard error (ours − paper)"
    table = Table("row", "prior", "α", "γ", "Z mean", "Z sd", "R mean", "R sd", title=title)
    for row in result["rows"]:
        cells = [_cell(row, key, result["runs"]) for key in ("z_mean", "z_sd", "r_mean", "r_sd")]
        prior = "yes" if row["prior"] else "no"
        table.add_row(str(row["row"]), prior, f"{row['learning_rate']:.2f}", f"{row['discount']:.2f}", *cells)
    console.print(table)
    print_criterion(result["criterion"], console)


def _cell(row: dict[str, Any], key: str, runs: int) -> str:
    """Format a cell; the standard error of a mean is sd / sqrt(n), of an sd about sd / sqrt(2 (n - 1))."""
    mean = key.endswith("mean")
    spread = row[key.replace("mean", "sd")]
    error = spread / sqrt(runs) if mean else spread / sqrt(2 * (runs - 1))
    return f"{row[key]:.2f} ± {error:.2f} ({row[key] - row['paper'][key]:+.2f})"


def print_users(result: dict[str, Any], console: Console) -> None:
    """Print the break-even and the reward of each user, with and without the prior."""
    title = f"Users A to D, {result['runs']} runs, seed {result['seed']}"
    table = Table("user", "prior", "break-even", "R mean ± standard error", title=title)
    for row in result["users"]:
        reward = f"{row['reward_mean']:.2f} ± {row['reward_se']:.2f}"
        table.add_row(row["user"], "yes" if row["prior"] else "no", _episode_text(row["crossing"]), reward)
    console.print(table)
    print_criterion(result["criterion"], console)


def print_learners(result: dict[str, Any], console: Console) -> None:
    """Print reward, break-even, regret and worst dip of each learner with each user."""
    title = f"Learners, {result['runs']} runs, seed {result['seed']}: means ± standard errors"
    table = Table("user", "learner", "reward", "break-even", "regret", "worst dip", title=title)
    for row in result["results"]:
        error = f"{row['reward_se']:.2f}"
        regret = "-" if row["regret_mean"] is None else f"{row['regret_mean']:.2f} ± {error}"
        dip = f"{row['worst_dip']:.2f} ± {row['worst_dip_se']:.2f}"
        reward = f"{row['reward_mean']:.2f} ± {error}"
        table.add_row(row["user"], row["learner"], reward, _episode_text(row["break_even"]), regret, dip)
    console.print(table)


def print_criterion(criterion: list[Point], console: Console) -> None:
    """Print the verdict on each point, and advice if one fails."""
    table = Table("criterion", "verdict", "detail", title="Criterion (docs/model.md)")
    for point in criterion:
        verdict = "[green]holds[/]" if point["passed"] else "[red]fails[/]"
        table.add_row(point["point"], verdict, point["detail"])
    console.print(table)
    if not passed(criterion):
        console.print("A 500-run sample of this model passes all of it in about 9 of 10 seeds: try two more seeds.")


def _episode_text(number: int | None) -> str:
    return "never" if number is None else str(number)
