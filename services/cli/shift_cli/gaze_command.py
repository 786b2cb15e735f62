"""``shift-mesh gaze play``: stream a recording of an eye tracker as if it were live."""

from __future__ import annotations

import re
import secrets
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from shift_cli.gaze_playing import check_names, describe, nothing_counted, stream
from shift_cli.screen_option import screen_size

if TYPE_CHECKING:
    pass

app = typer.Typer(no_args_is_help=True, help="Gaze recordings.")
FILE_OPTIONS = "What the file does not say"
"""The heading of the options about units, sizes and names, in the help."""


def _of_file(help_: str, envvar: str, **more: Any) -> Any:
    """Return an option about what the file does not say."""
    return typer.Option(help=help_, envvar=envvar, rich_help_panel=FILE_OPTIONS, **more)


@app.callback()
def _gaze() -> None:
    """Gaze recordings."""


@app.command()
def play(
    file: Annotated[Path, typer.Argument(help="A gaze file; gaze formats lists what is read.", envvar="SHIFT_FILE")],
    session: Annotated[str, typer.Option(help="The session to stream into.", envvar="SHIFT_SESSION")],
    speed: Annotated[
        float, typer.Option("--speed", "--rate", help="Times real time.", envvar="SHIFT_SPEED", min=0.01, max=1000)
    ] = 1.0,
    url: Annotated[str, typer.Option(help="The gateway.", envvar="SHIFT_URL")] = "http://127.0.0.1:8080",
    source: Annotated[
        str | None, typer.Option(help="Name of the gaze source; left out: one of its own.", envvar="SHIFT_SOURCE")
    ] = None,
    markers: Annotated[
        bool, typer.Option(help="Set the file's messages as markers of the session.", envvar="SHIFT_MARKERS")
    ] = True,
    format_: Annotated[
        str,
        typer.Option("--format", help="Insist on this format; left out: by the content.", envvar="SHIFT_FORMAT"),
    ] = "",
    screen: Annotated[str, _of_file("Size in pixels, for files with pixels: 1920x1080.", "SHIFT_SCREEN")] = "",
    screen_mm: Annotated[
        str, _of_file("Size in millimetres, for files with millimetres or degrees: 509x286.", "SHIFT_SCREEN_MM")
    ] = "",
    distance_mm: Annotated[
        float | None,
        _of_file("From the eyes to the screen, for files with degrees: 650.", "SHIFT_DISTANCE_MM", min=1),
    ] = None,
    origin: Annotated[
        str,
        _of_file("Where positions begin: top-left, bottom-left, centre (y upwards), centre-down.", "SHIFT_ORIGIN"),
    ] = "",
    time_unit: Annotated[
        str, _of_file("Unit of a time that has none in the header of a Tobii table: ms.", "SHIFT_TIME_UNIT")
    ] = "",
    aoi: Annotated[
        bool, _of_file("Take AOI names from a file that has points too; left out: the points.", "SHIFT_AOI")
    ] = False,
    aoi_map: Annotated[
        list[str] | None,
        _of_file("The study's name of a file's AOI: 'AOI 1=cup'; 'AOI 1=' is none. Repeatable.", "SHIFT_AOI_MAP"),
    ] = None,
    recording: Annotated[
        str, _of_file("How the id of the recording begins, for files of several.", "SHIFT_RECORDING")
    ] = "",
    columns: Annotated[
        str, _of_file("The columns of any other table: 't=time:ms,x=gx:px,y=gy:px'.", "SHIFT_COLUMNS")
    ] = "",
    lost: Annotated[str, _of_file("What means loss in a table with --columns: -1,9999.", "SHIFT_LOST")] = "",
) -> None:
    """Stream a recording of an eye tracker into a session, with its own timing.

    The command prints the rate, the duration, and the shares of samples that are lost or off the stimulus. The exit
    code is 1 if none of the gaze counted, because no sample was dwell on an AOI.

    \b
    shift-mesh gaze play trial1.tsv.gz --session s1
    shift-mesh gaze play trial1.tsv.gz --session s1 --speed 20
    shift-mesh gaze play gaze.csv --session s1 --screen 1600x1200
    shift-mesh gaze play all_gaze.csv --session s1 --aoi --aoi-map 'AOI 1=cup' --aoi-map 'AOI 2=robot'
    shift-mesh gaze play own.csv --session s1 --columns 't=time:ms,x=gx:px,y=gy:px' --screen 1920x1080 --lost -1
    """
    from shift_runtime.rest_client import RestClient
    from shift_schemas.errors import MalformedMessage, check_id
    from shift_sources.files.formats import read_gaze
    from shift_sources.files.options import Options, aoi_map_of, lost_of, millimetres_of, origin_of, time_unit_of

    if source is not None:
        check_id("--source", source)
    options = Options(
        screen=screen_size(screen), screen_mm=millimetres_of(screen_mm), distance_mm=distance_mm,
        origin=origin_of(origin), time_unit=time_unit_of(time_unit), named=aoi, aoi_map=aoi_map_of(aoi_map or ()),
        recording=recording, columns=columns, lost=lost_of(lost),
    )  # fmt: skip
    found = read_gaze(file, options, format_)
    if not found.samples:
        raise MalformedMessage(f"{file.name} holds no samples")
    if not markers:
        found = found._replace(markers=[])
    with RestClient(url) as shift:
        if found.named:
            check_names(found, shift.config(session), file.name)
        before = shift.observation(session)["gaze"]
        warnings = stream(shift, session, found, source or _source_of(file), file.name, speed)
        after = shift.observation(session)["gaze"]
    said = describe(found.samples, found.named)
    typer.echo(f"{said.sentence}{_markers(len(found.markers))}, into session {session}", err=True)
    for warning in warnings:
        typer.echo(f"warning: {warning}", err=True)
    if why := nothing_counted(said, found.named, before, after):
        typer.echo(f"nothing of this gaze counted: {why}", err=True)
        raise typer.Exit(1)


@app.command()
def formats(
    as_json: Annotated[bool, typer.Option("--json", help="One JSON document.", envvar="SHIFT_JSON")] = False,
) -> None:
    """List the formats of gaze files that are read, with the columns by which they are recognised.

    \b
    shift-mesh gaze formats
    shift-mesh gaze formats --json
    """
    import json

    from shift_sources.files.formats import ABOUT

    if as_json:
        typer.echo(json.dumps({"formats": ABOUT}, ensure_ascii=False))
        return
    for name, about in ABOUT.items():
        typer.echo(f"{name:16} {about}")


def _markers(n: int) -> str:
    return f", {n} marker{'s' if n > 1 else ''}" if n else ""


def _source_of(file: Path) -> str:
    """Return a name for this run: the chunks of a source are numbered from 0, so a second run is another source."""
    stem = re.sub(r"[^A-Za-z0-9_-]", "-", file.name.split(".")[0])[:40].lstrip("-_") or "file"
    return f"{stem}-{secrets.token_hex(3)}"
