"""``shift-mesh verify``: is a recording what its inputs give?"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from shift_cli.recording_options import Files, Json, Scheduler, Workers, with_progress

if TYPE_CHECKING:
    from shift_verify.many import RecordingReport
    from shift_verify.verify import VerifyReport


def verify(
    files: Files,
    report: Annotated[
        Path | None, typer.Option(help="Also write a readable report, in Markdown.", envvar="SHIFT_REPORT")
    ] = None,
    workers: Workers = 0,
    scheduler: Scheduler = "",
    as_json: Json = False,
) -> None:
    """Derive every output of a recording again from its inputs, and report the first difference.

    Exit code 0: there is none; 1: there is one, or a file is damaged. With several recordings, --json prints
    {"recordings", "ok", "complete", "reports"}.

    \b
    shift-mesh verify data/recordings/s1.mcap
    shift-mesh verify s1.mcap --json | jq .difference
    shift-mesh verify data/recordings --report verification.md
    """
    import json

    from shift_recording.files import recordings_in

    paths = recordings_in(files)
    reports = _reports(paths, workers, scheduler)
    if report is not None:
        _write(report, reports)
    verified = [each.verified for each in reports]
    if as_json:
        single = len(paths) == 1 and not files[0].is_dir()
        typer.echo(json.dumps(reports[0].as_json() if single else _all_as_json(reports), ensure_ascii=False))
    else:
        for each in verified:
            _show(each)
        if len(verified) > 1:
            typer.echo(f"{sum(v.ok for v in verified)} of {len(verified)} recordings have no difference")
    raise typer.Exit(0 if all(v.ok for v in verified) else 1)


def _reports(paths: tuple[Path, ...], workers: int, scheduler: str) -> list[RecordingReport]:
    from rich.console import Console
    from rich.progress import Progress
    from shift_verify.many import report_on, report_on_many

    if len(paths) > 1 or scheduler:
        found = report_on_many(paths, workers, scheduler)
        return list(with_progress(f"verifying {len(paths)} recordings", found, len(paths)))
    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task(f"verifying {paths[0].name}", total=None)
        return [report_on(paths[0], lambda done, total: bar.update(task, completed=done, total=total))]


def _all_as_json(reports: list[RecordingReport]) -> dict[str, object]:
    verified = [each.verified for each in reports]
    return {
        "recordings": len(reports), "ok": sum(v.ok for v in verified), "complete": sum(v.complete for v in verified),
        "reports": [each.as_json() for each in reports],
    }  # fmt: skip


def _write(path: Path, reports: list[RecordingReport]) -> None:
    from importlib.metadata import version

    from shift_recording.durable_file import write_durably
    from shift_verify.supplement import supplement

    write_durably(path, supplement(reports, version("shift-mesh")).encode())
    typer.echo(f"report in {path}", err=True)


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
