"""``shift-mesh info``: summarise a recording."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from rich.table import Table
    from shift_recording.summary import RecordingInfo


def info(
    file: Annotated[Path, typer.Argument(help="The recording.", exists=True, dir_okay=False, envvar="SHIFT_FILE")],
    as_json: Annotated[bool, typer.Option("--json", help="One JSON document.", envvar="SHIFT_JSON")] = False,
) -> None:
    """Show the session of a recording, its length, its messages by kind, and whether it is complete.

    The exit code is 1 if the recording is damaged, has no messages or does not match its checksum.

    \b
    shift-mesh info data/recordings/s1.mcap
    shift-mesh info s1.mcap --json | jq .counts
    """
    import json

    from rich.console import Console
    from shift_recording.summary import info_of

    found = info_of(file)
    if as_json:
        typer.echo(json.dumps(found.as_json(), ensure_ascii=False))
    else:
        console = Console()
        console.print(_about(found))
        console.print(_counts(found))
        if found.clocks:
            console.print(_clocks(found))
    raise typer.Exit(1 if found.damaged or found.checksum == "differs" or not found.counts else 0)


def _about(found: RecordingInfo) -> Table:
    from rich.markup import escape
    from rich.table import Table

    whole = "complete" if found.complete else f"incomplete: {found.reason}"
    rows = {
        "session": found.session, "participant": found.participant, "study": found.study,
        "condition": found.condition or "-", "seed": "-" if found.seed is None else str(found.seed),
        "started": found.started, "ended": found.ended or "-", "duration": f"{found.duration_s:.1f} s",
        "state": f"damaged: {found.reason}" if found.damaged else whole,
        "checksum": {"matches": "matches", "missing": "none beside the file"}.get(found.checksum, "differs"),
        "written by": found.library,
    }  # fmt: skip
    table = Table(title=escape(f"{found.file}, {found.bytes:,} bytes"), show_header=False, title_justify="left")
    for name, value in rows.items():
        table.add_row(name, escape(value))
    return table


def _counts(found: RecordingInfo) -> Table:
    from rich.markup import escape
    from rich.table import Table

    table = Table("topic or attachment", "messages", "bytes")
    for topic, n in found.counts.items():
        samples = f" chunks, {found.gaze_samples} samples" if topic == "gaze" else ""
        table.add_row(escape(topic), f"{n}{samples}", "")
    for name, size in found.attachments.items():
        table.add_row(escape(name), "", f"{size:,}")
    return table


def _clocks(found: RecordingInfo) -> Table:
    """Return the ledgers, one column for each source."""
    from rich.markup import escape
    from rich.table import Table

    table = Table("gaze source", *(escape(clock["source"]) for clock in found.clocks))
    described = [_about_clock(clock) for clock in found.clocks]
    for name in described[0]:
        table.add_row(name, *(about[name] for about in described))
    return table


def _about_clock(clock: dict[str, Any]) -> dict[str, str]:
    steps = [f"{segment['step_s']:+.3f} s" for segment in (clock["segments"] or ())[1:]]
    return {
        **{name: str(clock[name]) for name in ("chunks", "samples", "late", "missing", "repeated")},
        "refused": ", ".join(f"{n} {kind}" for kind, n in clock["refused"].items()) or "0",
        "rate": "-" if clock["rate_hz"] is None else f"{clock['rate_hz']:.4g} Hz",
        "longest gap": f"{clock['longest_gap_s']:.3g} s",
        "restarts and jumps": str(clock["restarts"]),
        "the clock was set by": ", ".join(steps) or "-",
        "offset to the mesh": "-" if clock["offset_s"] is None else f"{clock['offset_s']:.3f} s",
        "drift": "-" if clock["drift_ppm"] is None else f"{clock['drift_ppm']:+.0f} ppm",
        "round trip": "-" if clock["round_trip_s"] is None else f"{1000 * clock['round_trip_s']:.1f} ms",
    }
