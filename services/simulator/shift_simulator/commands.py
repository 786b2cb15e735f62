"""``shift-mesh evaluate``: the paper reproduced, and learners compared. A Typer app for the command line.

With ``--json`` one document goes to standard output and nothing else; progress goes to standard error. Exit
codes: 0 fine, 1 the criterion does not hold, 2 wrong use.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from shift_simulator.options import LEARNER_HELP, USER_HELP, USER_METAVAR, check_learner

app = typer.Typer(
    no_args_is_help=True, add_completion=False, rich_markup_mode="rich", help="Evaluate the model with simulated users."
)

Runs = Annotated[int, typer.Option(help="Simulated sessions per row.", envvar="SHIFT_RUNS", min=2, max=1_000_000)]
Seed = Annotated[int, typer.Option(help="Seed of the experiment.", envvar="SHIFT_SEED", min=0, max=2**53 - 1)]
Out = Annotated[Path | None, typer.Option(help="Folder for the JSON and the figures.", envvar="SHIFT_OUT")]
Json = Annotated[bool, typer.Option("--json", help="One JSON document on standard output.", envvar="SHIFT_JSON")]


@app.command()
def table2(runs: Runs = 500, seed: Seed = 0, out: Out = None, as_json: Json = False) -> None:
    """The paper's Table II beside ours, and the verdict on points 1 to 3 of the frozen criterion.

    \b
    shift-mesh evaluate table2
    shift-mesh evaluate table2 --seed 7 --runs 500 --json
    """
    from shift_simulator import report
    from shift_simulator import table2 as experiment

    _make_folder(out)
    with _progress("twelve rows"):
        result = experiment.table2(seed, runs)
    _put_out("table2", result, out, as_json, report.print_table2)
    _judge(result)


@app.command()
def users(runs: Runs = 500, seed: Seed = 0, out: Out = None, as_json: Json = False) -> None:
    """Users A to D with and without the scoring prior: crossings, rewards, figure, point 4 of the criterion.

    \b
    shift-mesh evaluate users
    shift-mesh evaluate users --out results     # users.json, users.png and users.svg
    """
    from shift_simulator import report, user_study

    _make_folder(out)
    with _progress("users A to D"):
        result = user_study.users(seed, runs)
    if out is not None:
        user_study.draw_users(result, out)
    _put_out("users", result, out, as_json, report.print_users)
    _judge(result)


@app.command()
def learners(
    learner: Annotated[
        list[str] | None,
        typer.Option(help=f"{LEARNER_HELP} Repeatable; left out: all.", envvar="SHIFT_LEARNER", callback=check_learner),
    ] = None,
    user: Annotated[
        list[str] | None,
        typer.Option(help=f"{USER_HELP} Repeatable; left out: A to D.", envvar="SHIFT_USER", metavar=USER_METAVAR),
    ] = None,
    runs: Runs = 200,
    seed: Seed = 0,
    regret: Annotated[
        bool, typer.Option("--regret", help="Compute the exact optimum of each user.", envvar="SHIFT_REGRET")
    ] = False,
    out: Out = None,
    as_json: Json = False,
) -> None:
    """Reward, break-even, regret and worst dip of learners with users.

    \b
    shift-mesh evaluate learners --regret
    shift-mesh evaluate learners --learner planner --learner q-learning --user docs/examples/my-user.json --json
    """
    from shift_learner.learners import LEARNERS

    from shift_simulator import compare, report
    from shift_simulator.user_files import user_named

    names = learner or list(LEARNERS)
    people = [user_named(name) for name in user or ("A", "B", "C", "D")]
    _make_folder(out)
    with _progress("learners") as said:
        result = compare.compare(names, people, seed, runs, regret, said)
    if out is not None:
        compare.draw_learners(result, out)
    _put_out("learners", result, out, as_json, report.print_learners)


def _make_folder(out: Path | None) -> None:
    """Make the folder for the results before anything is computed, so that a wrong path costs no waiting."""
    if out is None:
        return
    from shift_schemas.errors import InvalidSettings

    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as e:
        raise InvalidSettings(f"--out is {out}: this folder cannot be made: {e.strerror}; give another one") from e
    if not os.access(out, os.W_OK):
        raise InvalidSettings(f"--out is {out}: this folder cannot be written; give another one")


@contextmanager
def _progress(what: str) -> Iterator[Callable[[str], None]]:
    """A spinner on standard error that can be told what is being done."""
    with Console(stderr=True).status(what) as status:
        yield status.update


def _put_out(
    name: str, result: dict[str, Any], out: Path | None, as_json: bool, show: Callable[[dict[str, Any], Console], None]
) -> None:
    if out is not None:
        (out / f"{name}.json").write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    if as_json:
        typer.echo(json.dumps(result))
    else:
        show(result, Console(width=None if Console().is_terminal else 140))


def _judge(result: dict[str, Any]) -> None:
    from shift_simulator.criterion import passed

    raise typer.Exit(0 if passed(result["criterion"]) else 1)
