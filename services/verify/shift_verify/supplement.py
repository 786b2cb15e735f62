"""A report for a paper's supplement: what was verified, with which versions, and how good the gaze was. Pure."""

from __future__ import annotations

from collections.abc import Sequence

from shift_recording.gaze_quality import SourceQuality
from shift_schemas.messages import Clock

from shift_verify.many import RecordingReport

HEAD = """# Verification of {count} recording{plural}

Every output of the services was derived again from the recorded inputs, through the same program code, and compared
with what was recorded, by shift-mesh {version}. The first difference of each recording is reported.

- {ok} of {count} have no difference.
- {complete} of {count} are complete: the session ended, and the file is whole.
- {checksums} of {count} match the checksum beside the file.
- {messages:,} messages were derived again.
"""
COLUMNS = ("recording", "participant", "condition", "result", "messages", "checksum", "format", "written by")
GAZE_COLUMNS = ("recording", "source", "samples", "rate", "lost", "on AOIs", "gaps", "longest gap", "restarts",
                "late / missing chunks", "clock")  # fmt: skip


CLOCK_COLUMNS = ("recording", "source", "repeated", "refused", "segments", "the clock was set by", "offset", "drift",
                 "round trip")  # fmt: skip


def supplement(reports: Sequence[RecordingReport], version: str) -> str:
    """Return the report as Markdown."""
    verified = [report.verified for report in reports]
    head = HEAD.format(
        count=len(reports), plural="" if len(reports) == 1 else "s", version=version, ok=sum(v.ok for v in verified),
        complete=sum(v.complete for v in verified), checksums=sum(v.checksum == "matches" for v in verified),
        messages=sum(sum(v.checked.values()) for v in verified),
    )  # fmt: skip
    gaze = [(report.verified.file, source) for report in reports for source in report.gaze]
    parts = [head, "## Recordings\n", _table(COLUMNS, [_recording_row(report) for report in reports])]
    parts += ["## Gaze\n", _table(GAZE_COLUMNS, [_gaze_row(*each) for each in gaze])] if gaze else []
    clocks = [(report.verified.file, clock) for report in reports for clock in report.clocks]
    parts += ["## Clocks\n", _table(CLOCK_COLUMNS, [_clock_row(*each) for each in clocks])] if clocks else []
    digests = [(report.verified.file, f"`{report.sha256}`") for report in reports]
    return "\n".join([*parts, "## SHA-256\n", _table(("recording", "checksum"), digests)])


def _recording_row(report: RecordingReport) -> tuple[str, ...]:
    found = report.verified
    result = f"differs: {found.difference.sentence}" if found.difference else "no difference"
    if not found.complete and found.reason:
        result += f"; incomplete: {found.reason}"
    return (
        found.file, report.participant, report.condition or "-", result, str(sum(found.checked.values())),
        found.checksum, str(report.format or "-"), report.software or "-",
    )  # fmt: skip


def _gaze_row(file: str, gaze: SourceQuality) -> tuple[str, ...]:
    clock = "-"
    if gaze.drift_ppm is not None and gaze.delay_spread_s is not None:
        clock = f"{gaze.drift_ppm:+.0f} ppm, delays ±{1000 * gaze.delay_spread_s:.1f} ms"
    return (
        file, gaze.source, str(gaze.samples), _number(gaze.rate_hz, " Hz"), _share(gaze.lost), _share(gaze.on_aoi),
        str(gaze.gaps), f"{gaze.longest_gap_s:.2f} s", str(gaze.segments - 1),
        f"{gaze.late_chunks} / {gaze.missing_chunks}", clock,
    )  # fmt: skip


def _clock_row(file: str, clock: Clock) -> tuple[str, ...]:
    refused = ", ".join(f"{count} {kind}" for kind, count in clock.refused.items()) or "0"
    steps = ", ".join(f"{segment.step_s:+.3f} s" for segment in (clock.segments or [])[1:]) or "-"
    offset = "-" if clock.offset_s is None else f"{clock.offset_s:.3f} s"
    drift = "-" if clock.drift_ppm is None else f"{clock.drift_ppm:+.0f} ppm"
    trip = "-" if clock.round_trip_s is None else f"{1000 * clock.round_trip_s:.1f} ms"
    return file, clock.source, str(clock.repeated), refused, str(clock.restarts + 1), steps, offset, drift, trip


def _number(value: float | None, unit: str) -> str:
    return "-" if value is None else f"{value:.4g}{unit}"


def _share(value: float | None) -> str:
    return "-" if value is None else f"{100 * value:.1f} %"


def _table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [headings, ["---"] * len(headings), *rows]
    return "".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |\n" for line in lines)
