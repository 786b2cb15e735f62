"""``shift-mesh verify``: is a recording what its inputs give?"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from shift_verify.verify import VerifyReport


def verify(
    file: Annotated[Path, typer.Argument(help="The recording.", exists=True, dir_okay=False, envvar="SHIFT_FILE")],
    as_json: Annotated[bool, typer.Option("--json", help="One JSON document.", envvar="SHIFT_JSON")] = False,
) -> None:
    """Derive every output of a recording again from its inputs, and report the first difference.

    Exit code 0: there is none; 1: there is one, or the file is damaged.

    \b
    shift-mesh verify data/recordings/s1.mcap
    shift-mesh verify s1.mcap --json | jq .difference
    """
    import json

    from rich.console import Console
    from rich.progress import Progress
    from shift_verify.verify import verify as verify_recording

    with Progress(console=Console(stderr=True), transient=True, disable=not Console(stderr=True).is_terminal) as bar:
        task = bar.add_task(f"verifying {file.name}", total=None)
        report = verify_recording(file, lambda done, total: bar.update(task, completed=done, total=total))
    if as_json:
        typer.echo(json.dumps(report.as_json(), ensure_ascii=False))
    else:
        _show(report)
    raise typer.Exit(0 if report.ok else 1)


def _show(report: VerifyReport) -> None:
    checked = ", ".join(f"{n} {subject}" for subject, n in report.checked.items()) or "nothing"
    typer.echo(f"{report.file}: checked {checked}")
    typer.echo(
        {"matches": "checksum matches", "missing": "no checksum beside it"}.get(report.checksum, "checksum differs")
    )
    if not report.complete and report.reason:
        typer.echo(f"incomplete: {report.reason}")
    if report.difference is not None:
        typer.echo(f"NOT VERIFIED: the first difference is in {report.difference.sentence}")
    elif report.complete:
        typer.echo("VERIFIED: no difference")
    else:
        typer.echo("VERIFIED as far as it goes: no difference in what is there; the recording is not complete")
