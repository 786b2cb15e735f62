"""``shift-mesh gaze play``: a recording of an eye tracker, streamed in as if it were live."""

from __future__ import annotations

import re
import secrets
import time
from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(no_args_is_help=True, help="Gaze recordings.")
PIECE_S = 0.05
"""A chunk holds what a tracker would have seen in this much real time; chosen: no delay that a person notices."""


@app.callback()
def _gaze() -> None:
    """Gaze recordings."""


@app.command()
def play(
    file: Annotated[Path, typer.Argument(help="Tobii TX300 or Titta table (TSV), or its gzip.")],
    session: Annotated[str, typer.Option(help="The session to stream into.", envvar="SHIFT_SESSION")],
    speed: Annotated[float, typer.Option(help="Times real time.", envvar="SHIFT_SPEED", min=0.01, max=1000)] = 1.0,
    url: Annotated[str, typer.Option(help="The gateway.", envvar="SHIFT_URL")] = "http://127.0.0.1:8080",
    source: Annotated[str | None, typer.Option(help="Name of the gaze source; left out: one of its own.")] = None,
) -> None:
    """Stream a recording of an eye tracker into a session, with its own timing.

    \b
    shift-mesh gaze play trial1.tsv.gz --session s1
    shift-mesh gaze play trial1.tsv.gz --session s1 --speed 20
    """
    from rich.console import Console
    from rich.progress import Progress
    from shift_runtime.rest_client import RestClient
    from shift_schemas.errors import MalformedMessage

    from shift_cli.gaze_files import chunks, samples

    found = list(samples(file))
    if not found:
        raise MalformedMessage(f"{file.name} holds no samples")
    length_s = found[-1].t - found[0].t
    per_chunk = max(1, round(len(found) / max(length_s, 1e-9) * PIECE_S * speed))
    with RestClient(url) as shift, Progress(console=Console(stderr=True)) as progress:
        bar = progress.add_task(f"{file.name} at {speed:g}x", total=len(found))
        begun = time.monotonic()
        for chunk in chunks(found, per_chunk, source or _source_of(file)):
            time.sleep(max(0.0, begun + (chunk.t[-1] - found[0].t) / speed - time.monotonic()))
            shift.gaze(session, chunk)
            progress.advance(bar, len(chunk.t))
    typer.echo(f"{len(found)} samples, {length_s:.1f} s of gaze, into session {session}", err=True)


def _source_of(file: Path) -> str:
    """A name for this play: a source's chunks are numbered from 0, so a second play is another source."""
    stem = re.sub(r"[^A-Za-z0-9_-]", "-", file.name.split(".")[0])[:40].lstrip("-_") or "file"
    return f"{stem}-{secrets.token_hex(3)}"
