"""Verification of a recording, in a process of its own, and what the page says about its result."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from shift_verify.verify import VerifyReport, verify

from shift_gateway.web.worker_process import Progress, Send

WORK = f"{__name__}:send_verification"
NO_DIFFERENCE = "no difference"


class VerifyResult(NamedTuple):
    """What the page shows of a report."""

    ok: bool
    sentence: str
    """``no difference``, or the first difference."""
    details: str


def send_verification(send: Send, path: str) -> None:
    """Verify the recording, and send progress and result."""

    def on_progress(done: int, total: int) -> None:
        send(Progress(done / total if total else 1.0))

    send(result_of(verify(Path(path), on_progress)))


def result_of(report: VerifyReport) -> VerifyResult:
    """Return what the page shows of a report."""
    if report.difference is not None:
        sentence = f"the first difference is in {report.difference.sentence}"
    elif report.complete:
        sentence = NO_DIFFERENCE
    else:
        sentence = f"{NO_DIFFERENCE} in what is there; the recording is not complete: {report.reason}"
    checksum = {"matches": "The checksum matches.", "missing": "There is no checksum beside the file."}
    counts = ", ".join(f"{count} {subject}" for subject, count in report.checked.items())
    checked = f"Derived again: {counts}." if counts else "Nothing could be derived again."
    return VerifyResult(report.ok, sentence, f"{checksum.get(report.checksum, 'The checksum differs.')} {checked}")
