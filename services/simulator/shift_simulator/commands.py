"""``shift-mesh evaluate``: reproduce the paper and compare learners. A Typer app for the command line.

With ``--json``, standard output has exactly one JSON document. Progress goes to standard error. Exit codes: 0 for
success, 1 if the criterion does not hold, 2 for wrong use.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.progress import Progress

from shift_simulator.options import LEARNER_HELP, USER_HELP, USER_METAVAR, check_learner

app = typer.Typer(
    no_args_is_help=True, add_completion=False, rich_markup_mode="rich", help="Evaluate the model with simulated users."
)

Runs = Annotated[int, typer.Option(help="Simulated sessions per row.", envvar="SHIFT_RUNS", min=2, max=1_000_000)]
Seed = Annotated[int, typer.Option(help="Seed of the experiment.", envvar="SHIFT_SEED", min=0, max=2**53 - 1)]
Out = Annotated[Path | None, typer.Option(help="Folder for the JSON file and the figures.", envvar="SHIFT_OUT")]
Workers = Annotated[
    int, typer.Option(help="Processes at the same time; 0: one for each core.", min=0, envvar="SHIFT_WORKERS")
]
Scheduler = Annotated[
    str, typer.Option(help="A Dask scheduler, tcp://HOST:PORT, that does the work.", envvar="SHIFT_SCHEDULER")
]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON document.", envvar="SHIFT_JSON")]


@app.command()
def table2(runs: Runs = 500, seed: Seed = 0, out: Out = None, as_json: Json = False) -> None:
    """Compute the paper's Table II, compare it with the paper, and check points 1 to 3 of the criterion.

    \b
    shift-mesh evaluate table2
    shift-mesh evaluate table2 --seed 7 --runs 500 --json
    """
    from shift_simulator import report
    from shift_simulator import table2 as experiment

    _make_folder(out)
    with _steps("interactions") as on_progress:
        result = experiment.table2(seed, runs, on_progress)
    _output("table2", result, out, as_json, report.print_table2)
    _exit_by_criterion(result)


@app.command()
def users(
    runs: Runs = 500,
    seed: Seed = 0,
    out: Out = None,
    workers: Workers = 1,
    scheduler: Scheduler = "",
    as_json: Json = False,
) -> None:
    """Simulate users A to D with and without the scoring prior, and check point 4 of the criterion.

    \b
    shift-mesh evaluate users
    shift-mesh evaluate users --out results     # users.json, users.png and users.svg
    """
    from shift_simulator import report, user_study

    _make_folder(out)
    with _steps("users") as on_progress:
        result = user_study.users(seed, runs, on_progress, workers, scheduler)
    if out is not None:
        user_study.draw_users(result, out)
    _output("users", result, out, as_json, report.print_users)
    _exit_by_criterion(result)


@app.command()
def learners(
    learner: Annotated[
        list[str] | None,
        typer.Option(help=f"{LEARNER_HELP} Repeatable; default: all.", envvar="SHIFT_LEARNER", callback=check_learner),
    ] = None,
    user: Annotated[
        list[str] | None,
        typer.Option(help=f"{USER_HELP} Repeatable; default: A to D.", envvar="SHIFT_USER", metavar=USER_METAVAR),
    ] = None,
    runs: Runs = 200,
    seed: Seed = 0,
    regret: Annotated[
        bool, typer.Option("--regret", help="Compute the exact optimum of each user.", envvar="SHIFT_REGRET")
    ] = False,
    out: Out = None,
    workers: Workers = 1,
    scheduler: Scheduler = "",
    as_json: Json = False,
) -> None:
    """Compare learners on simulated users: reward, break-even, regret and worst dip.

    \b
    shift-mesh evaluate learners --regret
    shift-mesh evaluate learners --learner planner --learner q-learning --user docs/examples/my-user.json --json
    """
    from shift_learner.learners import LEARNERS

    from shift_simulator import compare, report
    from shift_simulator.user_files import find_user

    names = learner or list(LEARNERS)
    people = [find_user(name) for name in user or ("A", "B", "C", "D")]
    _make_folder(out)
    with _progress("learners") as report_progress:
        result = compare.compare(names, people, seed, runs, regret, report_progress, workers, scheduler)
    if out is not None:
        compare.draw_learners(result, out)
    _output("learners", result, out, as_json, report.print_learners)


def _make_folder(out: Path | None) -> None:
    """Make the folder for the results before the computation, so that a wrong path fails at once."""
    if out is None:
        return
    from shift_schemas.errors import InvalidSettings

    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as e:
        raise InvalidSettings(f"--out is {out}: this folder cannot be created: {e.strerror}; give another one") from e
    if not os.access(out, os.W_OK):
        raise InvalidSettings(f"--out is {out}: this folder is not writable; give another one")


@contextmanager
def _progress(text: str) -> Iterator[Callable[[str], None]]:
    """Show a spinner on standard error; yield the function that changes its text."""
    with Console(stderr=True).status(text) as status:
        yield status.update


@contextmanager
def _steps(what: str) -> Iterator[Callable[[int, int], None]]:
    """Show a progress bar on standard error; where that is no terminal, write a line such as ``3 of 12 users``."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda done, total: print(f"{done} of {total} {what}", file=sys.stderr, flush=True)
        return
    with Progress(console=console, transient=True) as bar:
        task = bar.add_task(what)
        yield lambda done, total: bar.update(task, completed=done, total=total)


def _output(
    name: str, result: dict[str, Any], out: Path | None, as_json: bool, show: Callable[[dict[str, Any], Console], None]
) -> None:
    if out is not None:
        (out / f"{name}.json").write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    if as_json:
        typer.echo(json.dumps(result))
    else:
        show(result, Console(width=None if Console().is_terminal else 140))


def _exit_by_criterion(result: dict[str, Any]) -> None:
    from shift_simulator.criterion import passed

    raise typer.Exit(0 if passed(result["criterion"]) else 1)
