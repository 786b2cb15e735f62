"""``shift-mesh robust``: how much decisions depend on the accuracy of gaze."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Annotated

import typer

from shift_cli.recording_options import Files, Json, Scheduler, Workers, with_progress

if TYPE_CHECKING:
    from rich.table import Table
    from shift_analysis.robustness import Robustness, Stands

PERCENT = 100


def robust(
    files: Files,
    workers: Workers = 0,
    scheduler: Scheduler = "",
    by_participant: Annotated[
        bool,
        typer.Option("--by-participant", help="A table for each participant.", envvar="SHIFT_BY_PARTICIPANT"),
    ] = False,
    as_json: Json = False,
) -> None:
    """Decide recordings again with disturbed gaze, and print which share of the decisions stands.

    Gaze is moved by 0.5, 1 and 2 degrees in eight directions, gets noise of 0.5 degrees, and is thinned to a half and
    a fifth. The study's fixation settings give the size and the distance of the screen. --json prints
    {"recordings", "all", "participants", "without_points", "problems"} with every direction.
    Exit code 0: every recording was decided again; 1: some were not, and the others were.

    \b
    shift-mesh robust data/recordings
    shift-mesh robust s1.mcap --json | jq '.all["1 deg left"]'
    """
    from shift_analysis.robustness import Robustness, robustness
    from shift_recording.files import recordings_in

    paths = recordings_in(files)
    found = Robustness(list(with_progress("deciding again", robustness(paths, workers, scheduler), len(paths))))
    if as_json:
        typer.echo(json.dumps(found.as_json(), ensure_ascii=False))
    else:
        _show(found, by_participant)
    for name, problem in found.problems.items():
        typer.echo(f"{name} was left out: {problem}", err=True)
    raise typer.Exit(1 if found.problems else 0)


def _show(found: Robustness, by_participant: bool) -> None:
    from rich.console import Console

    console = Console()
    console.print(_table("all recordings", found.stands()))
    for name in found.participants if by_participant else ():
        console.print(_table(f"participant {name}", found.stands(name)))
    without = [each.file for each in found.recordings if not each.problem and not each.has_points]
    if without:
        console.print(
            f"{', '.join(without)}: gaze is not given as points, so only thinning can change it", soft_wrap=True
        )


def _table(title: str, stands: dict[str, Stands]) -> Table:
    """Return the table of the shares that stand. All directions of a distance are one row: the worst and the best."""
    from rich.table import Table
    from shift_analysis.robustness import DEGREES

    respects = ("strategy", "cognitive_state", "gaze")
    table = Table("gaze", "decisions", "same strategy", "same cognitive state", "same gaze class", title=title)
    for degrees in DEGREES:
        rows = [each for name, each in stands.items() if name.startswith(f"{degrees:g} deg")]
        ranges = [_range(rows, name) for name in respects]
        table.add_row(f"moved {degrees:g} deg", str(rows[0].decisions), *ranges)
    for name, each in stands.items():
        if " deg " not in name:
            table.add_row(name, str(each.decisions), *(_range([each], respect) for respect in respects))
    return table


def _range(rows: list[Stands], name: str) -> str:
    if not rows[0].decisions:
        return "-"
    shares = sorted(PERCENT * getattr(row, name) / row.decisions for row in rows)
    low, high = f"{shares[0]:.1f}", f"{shares[-1]:.1f}"
    return f"{low} %" if low == high else f"{low} to {high} %"
