"""``shift-mesh recover`` and ``shift-mesh convert``: new, whole files from MCAP files of any program."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from shift_recording.recovery import Recovered


def recover(
    files: Annotated[
        list[Path], typer.Argument(help="Unfinished or damaged files, and folders of files.", envvar="SHIFT_FILES")
    ],
    out: Annotated[Path, typer.Option(help="Folder for the new files.", envvar="SHIFT_OUT")] = Path("recovered"),
    as_json: Annotated[bool, typer.Option("--json", help="One JSON document.", envvar="SHIFT_JSON")] = False,
) -> None:
    """Write everything that can be read of MCAP files to new, whole files; damaged chunks are skipped and reported.

    The files themselves are not changed. Exit code 0: nothing was lost; 1: something was.

    \b
    shift-mesh recover data/segments/s1/0001.mcap
    shift-mesh recover damaged.mcap --out repaired --json | jq '.files[0].lost_bytes'
    """
    from shift_recording.files import recordings_in
    from shift_recording.recovery import recover as recover_file

    found = [recover_file([path], out / path.name)[0] for path in recordings_in(files)]
    _report(found, as_json)


def convert(
    files: Annotated[list[Path], typer.Argument(help="MCAP files; several are merged.", envvar="SHIFT_FILES")],
    out: Annotated[Path, typer.Option(help="The new file.", envvar="SHIFT_OUT")],
    topics: Annotated[str, typer.Option(help="Only these topics, with commas between.", envvar="SHIFT_TOPICS")] = "",
    start: Annotated[
        float | None, typer.Option(help="From so many seconds after the first message on.", envvar="SHIFT_START")
    ] = None,
    end: Annotated[
        float | None, typer.Option(help="Up to so many seconds after the first message.", envvar="SHIFT_END")
    ] = None,
    sort: Annotated[bool, typer.Option("--sort", help="Write them by their log time.", envvar="SHIFT_SORT")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON document.", envvar="SHIFT_JSON")] = False,
) -> None:
    """Write a part of one or several MCAP files to a new file; several are merged by their log time.

    The new file is not a session's recording any more where messages are left out, and verify says so.

    \b
    shift-mesh convert s1.mcap --out decisions.mcap --topics decision,performance
    shift-mesh convert s1.mcap --out minute.mcap --start 60 --end 120
    shift-mesh convert robot.mcap s1.mcap --out both.mcap
    shift-mesh convert bag.mcap --out sorted.mcap --sort
    """
    from shift_recording.recovery import Wanted
    from shift_recording.recovery import recover as recover_file
    from shift_schemas.errors import InvalidSettings

    if start is not None and end is not None and end < start:
        raise InvalidSettings(f"--end is {end:g} and --start is {start:g}: the end must not be before the start")
    names = tuple(name.strip() for name in topics.split(",") if name.strip())
    _report(recover_file(files, out, Wanted(names or None, start, end, sort)), as_json)


def _report(found: list[Recovered], as_json: bool) -> None:
    if as_json:
        typer.echo(json.dumps({"files": [each.as_json() for each in found]}, ensure_ascii=False))
    else:
        for each in found:
            state = "read to its end" if each.complete else "not whole"
            lost = f", {each.lost_bytes} bytes lost" if each.lost_bytes else ""
            typer.echo(f"{each.name}: {state}, {each.messages} messages{lost}, written to {each.written}")
            for problem in each.problems:
                typer.echo(f"  {problem}", err=True)
    raise typer.Exit(1 if any(each.lost_bytes for each in found) else 0)
