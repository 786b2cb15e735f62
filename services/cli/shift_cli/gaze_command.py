"""``shift-mesh gaze play``: stream a recording of an eye tracker as if it were live."""

from __future__ import annotations

import re
import secrets
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from shift_cli.screen_option import pixels_of

if TYPE_CHECKING:
    from shift_runtime.rest_client import RestClient
    from shift_sources.files.samples import Sample
    from shift_sources.files.table import ScreenSize

app = typer.Typer(no_args_is_help=True, help="Gaze recordings.")
PIECE_S = 0.05
"""A chunk holds what a tracker would have seen in this much real time; chosen: no delay that a person notices."""


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
    screen: Annotated[
        str, typer.Option(help="Size in pixels, for files with pixels: 1920x1080.", envvar="SHIFT_SCREEN")
    ] = "",
    format_: Annotated[
        str,
        typer.Option("--format", help="Insist on this format; left out: by the content.", envvar="SHIFT_FORMAT"),
    ] = "",
) -> None:
    """Stream a recording of an eye tracker into a session, with its own timing.

    The command prints the rate, the duration, and the shares of samples that are lost or off the stimulus. The exit
    code is 1 if none of the gaze counted, because no sample was dwell on an AOI.

    \b
    shift-mesh gaze play trial1.tsv.gz --session s1
    shift-mesh gaze play trial1.tsv.gz --session s1 --speed 20
    shift-mesh gaze play gaze.csv --session s1 --screen 1600x1200
    """
    from shift_runtime.rest_client import RestClient
    from shift_schemas.errors import MalformedMessage, check_id
    from shift_sources.files.formats import read_samples

    if source is not None:
        check_id("--source", source)
    found = list(read_samples(file, _screen(screen), format_))
    if not found:
        raise MalformedMessage(f"{file.name} holds no samples")
    with RestClient(url) as shift:
        before = shift.observation(session)["gaze"]
        warnings = _stream(shift, session, found, source or _source_of(file), file.name, speed)
        after = shift.observation(session)["gaze"]
    said = describe(found)
    typer.echo(f"{said.sentence}, into session {session}", err=True)
    for warning in warnings:
        typer.echo(f"warning: {warning}", err=True)
    if why := _nothing_counted(said, before, after):
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
        typer.echo(f"{name:14} {about}")


def _screen(text: str) -> ScreenSize | None:
    """Return the size of ``--screen``. Raise :class:`InvalidSettings` for a text that is not one."""
    from shift_schemas.errors import InvalidSettings
    from shift_sources.files.table import ScreenSize

    if not text:
        return None
    size = pixels_of(text)
    if size is None:
        raise InvalidSettings(f"--screen is {text!r}: write width and height in pixels, such as 1920x1080")
    return ScreenSize(*size)


class Described(NamedTuple):
    """A description of a recording; shares are of its samples, 0..1."""

    rate_hz: float
    length_s: float
    lost: float
    off_stimulus: float
    sentence: str


def describe(found: Sequence[Sample]) -> Described:
    """Return rate, length and shares of a recording's samples, and a sentence about them."""
    length_s = found[-1].t - found[0].t
    rate_hz = (len(found) - 1) / length_s if length_s > 0 else 0.0
    points = [(s.x, s.y) for s in found if s.valid and s.x is not None and s.y is not None]
    off = sum(not (0.0 <= x <= 1.0 and 0.0 <= y <= 1.0) for x, y in points)
    lost, off_stimulus = 1 - len(points) / len(found), off / len(found)
    sentence = (
        f"{len(found)} samples at {rate_hz:.4g} Hz, {length_s:.1f} s of gaze, lost {lost:.1%}, "
        f"off the stimulus {off_stimulus:.1%}"
    )
    return Described(rate_hz, length_s, lost, off_stimulus, sentence)


def _stream(
    shift: RestClient, session: str, found: list[Sample], source: str, name: str, speed: float
) -> list[str]:  # fmt: skip
    """Send each sample at its time; return the warnings of the last answer and of restarts."""
    from rich.console import Console
    from rich.progress import Progress
    from shift_sources.files.samples import chunks

    length_s = found[-1].t - found[0].t
    per_chunk = max(1, round(len(found) / max(length_s, 1e-9) * PIECE_S * speed))
    answer: dict[str, Any] = {}
    begun_anew: list[str] = []
    with Progress(console=Console(stderr=True)) as progress:
        bar = progress.add_task(f"{name} at {speed:g}x", total=len(found))
        begun = time.monotonic()
        for chunk in chunks(found, per_chunk, source):
            time.sleep(max(0.0, begun + (chunk.t[-1] - found[0].t) / speed - time.monotonic()))
            answer = shift.gaze(session, chunk)
            begun_anew += [w for w in answer.get("warnings", ()) if "segment" in w]
            progress.advance(bar, len(chunk.t))
    return list(dict.fromkeys([*begun_anew, *answer.get("warnings", ())]))


def _nothing_counted(said: Described, before: dict[str, Any], after: dict[str, Any]) -> str:
    """Return why the gaze had no dwell on an AOI; empty if it had some, or if the session does not say."""
    if said.lost == 1.0:
        return "every sample is lost"
    if said.lost + said.off_stimulus == 1.0:
        return "every sample is lost or off the stimulus; check the file's units"
    if after.get("dwell_s") is None or after["dwell_s"] > before["dwell_s"]:
        return ""
    if after["samples"] == before["samples"]:
        return "the session had all of it already, under this source; give another --source to play it once more"
    return "no fixation of it fell on an AOI; check the study's AOIs, the rate and the share that is lost"


def _source_of(file: Path) -> str:
    """Return a name for this run: the chunks of a source are numbered from 0, so a second run is another source."""
    stem = re.sub(r"[^A-Za-z0-9_-]", "-", file.name.split(".")[0])[:40].lstrip("-_") or "file"
    return f"{stem}-{secrets.token_hex(3)}"
