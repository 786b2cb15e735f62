"""Verify many recordings at once, each in a process of a pool, with the quality of their gaze."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from shift_recording.checksum import sha256_of
from shift_recording.gaze_quality import GazeQuality, SourceQuality
from shift_recording.mcap.reader import Recording
from shift_recording.parallel import for_each
from shift_schemas.errors import ShiftError
from shift_schemas.messages import Clock, Gaze, Session

from shift_verify.verify import VerifyReport, verify


@dataclass(frozen=True)
class RecordingReport:
    """What verify found in one recording, whose it is, and how good its gaze is."""

    verified: VerifyReport
    sha256: str
    session: str = ""
    participant: str = ""
    study: str = ""
    condition: str = ""
    format: int = 0
    software: str = ""
    gaze: tuple[SourceQuality, ...] = ()
    clocks: tuple[Clock, ...] = ()
    """The last ledger of each gaze source; none is recorded before format 5."""

    def as_json(self) -> dict[str, Any]:
        """Return the report as ``--json`` prints it."""
        return {
            **self.verified.as_json(), "sha256": self.sha256, "session": self.session, "participant": self.participant,
            "study": self.study, "condition": self.condition, "format": self.format, "software": self.software,
            "gaze": [source.as_json() for source in self.gaze],
            "clocks": [clock.model_dump(mode="json", exclude={"session", "stamp", "seen"}) for clock in self.clocks],
        }  # fmt: skip


def report_on(path: Path, on_progress: Callable[[int, int], None] | None = None) -> RecordingReport:
    """Verify one recording, and describe it as far as it can be read. Raises :class:`UnknownThing`."""
    verified, digest = verify(path, on_progress), sha256_of(path)
    quality, session, clocks = GazeQuality(), None, dict[str, Clock]()
    try:
        for recorded in Recording(path).facts(("session", "gaze", "clock")):
            if isinstance(recorded.fact, Session):
                session = session or recorded.fact
            elif isinstance(recorded.fact, Gaze):
                quality.add(recorded.fact)
            elif isinstance(recorded.fact, Clock):
                clocks[recorded.fact.source] = recorded.fact
    except ShiftError:
        pass  # the report has it
    gaze, ledgers = tuple(quality.sources()), tuple(clocks.values())
    if session is None:
        return RecordingReport(verified, digest, gaze=gaze, clocks=ledgers)
    return RecordingReport(
        verified, digest, session.session, session.participant, session.study, session.condition or "",
        session.format, session.software, gaze, ledgers,
    )  # fmt: skip


def report_on_many(paths: Iterable[Path], workers: int = 0, scheduler: str = "") -> Iterator[RecordingReport]:
    """Yield the reports in the order of the paths; :func:`for_each` has the parameters."""
    yield from for_each(report_on, tuple(paths), workers, scheduler)
