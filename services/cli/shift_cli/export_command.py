"""``shift-mesh export``: tables from recordings."""

from __future__ import annotations

from collections.abc import Sized
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from shift_cli.recording_options import Files, Json, Scheduler, Workers
from shift_cli.screen_option import pixels_of

if TYPE_CHECKING:
    from shift_recording.export.export import Exported
    from shift_recording.export.screen import Screen


def export(
    files: Files,
    to: Annotated[
        Literal["csv", "parquet", "bids", "vw"],
        typer.Option(help="csv, parquet, bids (eye tracking), or vw (Vowpal Wabbit).", envvar="SHIFT_TO"),
    ],
    out: Annotated[Path, typer.Option(help="Folder for the files; it is made.", envvar="SHIFT_OUT")] = Path("export"),
    covariates: Annotated[
        Path | None,
        typer.Option(help="CSV with a column participant; its other columns are added.", envvar="SHIFT_COVARIATES"),
    ] = None,
    screen: Annotated[
        str, typer.Option(help="Size of the screen in pixels, for bids: 1920x1080.", envvar="SHIFT_SCREEN")
    ] = "",
    with_excluded: Annotated[
        bool,
        typer.Option("--with-excluded", help="Also recordings excluded from analysis.", envvar="SHIFT_WITH_EXCLUDED"),
    ] = False,
    workers: Workers = 0,
    scheduler: Scheduler = "",
    as_json: Json = False,
) -> None:
    """Write the tables of recordings: sessions, gaze, decisions and more, all recordings together.

    Exit code 0: everything was exported; 1: a recording is damaged, and the others were exported.

    \b
    shift-mesh export data/recordings --to csv --out tables
    shift-mesh export s1.mcap s2.mcap --to parquet --covariates people.csv
    shift-mesh export data/recordings --to bids --screen 1920x1080 --out bids
    """
    import json

    from rich.console import Console
    from rich.progress import Progress
    from shift_recording.export.export import Way
    from shift_recording.export.export import export as export_recordings

    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("exporting", total=None)
        done = export_recordings(
            files, to, out, covariates=covariates, screen=_screen(screen), with_excluded=with_excluded,
            way=Way(workers, scheduler, lambda read, total: bar.update(task, completed=read, total=total)),
        )  # fmt: skip
    typer.echo(json.dumps(done.as_json(), ensure_ascii=False)) if as_json else _show(done, out)
    for name, reason in done.report.excluded.items():
        typer.echo(f"{name} is excluded from analysis ({reason}) and left out; --with-excluded exports it", err=True)
    for name, reason in done.report.damaged.items():
        typer.echo(f"{name} is damaged and was exported up to there: {reason}", err=True)
    raise typer.Exit(1 if done.report.damaged else 0)


def _screen(text: str) -> Screen | None:
    from shift_recording.export.screen import Screen
    from shift_schemas.errors import InvalidSettings

    if not text:
        return None
    size = pixels_of(text)
    if size is None:
        raise InvalidSettings(f"--screen is {text!r}: write width and height in pixels, such as 1920x1080")
    return Screen(*size)


def _show(done: Exported, out: Path) -> None:
    rows = ", ".join(f"{count} {table.replace('_', ' ')}" for table, count in done.rows.items() if count) or "nothing"
    typer.echo(f"{_count(done.report.read, 'recording')}: {rows}")
    typer.echo(f"{_count(done.files, 'file')} in {out}/")


def _count(things: Sized, name: str) -> str:
    return f"{len(things)} {name}" + ("" if len(things) == 1 else "s")
