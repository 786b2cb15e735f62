"""Summarise a recording without deriving any message again."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from shift_schemas.errors import DamagedRecording, MalformedMessage
from shift_schemas.lifecycle import has_ended
from shift_schemas.messages import Clock, Session
from shift_schemas.timestamps import NS

from shift_recording.checksum import Checksum, check
from shift_recording.mcap.index import Index, index_of
from shift_recording.mcap.reader import RecordedMessage, Recording, Report, fact_of
from shift_recording.mcap.writer import SESSION_METADATA

ABOUT_SESSION = ("session", "clock")
"""The topics of which a summary needs the messages."""


@dataclass(frozen=True)
class RecordingInfo:
    """The summary of one recording.

    ``complete`` says whether the session ended and the file is whole; ``reason`` says why it is not, or how it is
    damaged. ``duration_s`` is the time from the session's start to its end; if it has not ended, the time from the
    first recorded message to the last one. ``gaze_samples`` counts the samples of all chunks of gaze.
    """

    file: str
    bytes: int
    library: str
    session: str
    participant: str
    study: str
    condition: str
    seed: int | None
    state: str
    started: str
    ended: str
    duration_s: float
    counts: dict[str, int]
    gaze_samples: int
    clocks: list[dict[str, Any]]
    """The last ledger of each gaze source (topic ``clock``); none is recorded before format 5."""
    attachments: dict[str, int]
    metadata: dict[str, dict[str, str]]
    checksum: str
    complete: bool
    damaged: bool
    reason: str

    def as_json(self) -> dict[str, Any]:
        """Return the summary for ``--json``, without the study's text, which is long and is among the attachments."""
        metadata = {name: {k: v for k, v in values.items() if k != "study" or name == SESSION_METADATA}
                    for name, values in self.metadata.items()}  # fmt: skip
        return asdict(self) | {"metadata": metadata}


@dataclass
class _Scanned:
    """What stands in the file."""

    counts: Counter[str] = field(default_factory=Counter)
    first: int = 0
    last: int = 0
    session: Session | None = None
    samples: int = 0
    clocks: dict[str, dict[str, Any]] = field(default_factory=dict)
    """By source."""
    library: str = ""
    attachments: dict[str, int] = field(default_factory=dict)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    report: Report = field(default_factory=lambda: Report(complete=False))

    def add(self, message: RecordedMessage) -> None:
        """Add what a message says of the session or of a source's clock."""
        if message.topic in ABOUT_SESSION:
            fact = fact_of(message.topic, message.data)
            if isinstance(fact, Session):
                self.session = fact
            elif isinstance(fact, Clock):
                self.clocks[fact.source] = fact.model_dump(mode="json", exclude={"session", "stamp", "seen"})


def info_of(path: Path) -> RecordingInfo:
    """Summarise a recording. A damaged or truncated recording is summarised as far as it can be read.

    A finished recording whose SHA-256 matches is summarised from its index, so an hour of gaze opens at once.

    Raises
    ------
    UnknownThing
        The file does not exist.
    """
    index = index_of(path)
    scanned = _from_index(index) if index is not None else None
    checksum = Checksum.MATCHES.value if index is not None else _checksum(path)
    if scanned is None:
        scanned = _scanned(Recording(path))
    said, fact, report = scanned.metadata.get(SESSION_METADATA, {}), scanned.session, scanned.report
    ended = fact is not None and has_ended(fact.state)
    return RecordingInfo(
        file=path.name,
        bytes=path.stat().st_size,
        library=scanned.library,
        session=fact.session if fact else said.get("session", ""),
        participant=fact.participant if fact else said.get("participant", ""),
        study=fact.study if fact else said.get("study", ""),
        condition=(fact.condition or "") if fact else said.get("condition", ""),
        seed=fact.seed if fact else None,
        state=fact.state if fact else "",
        started=_iso(fact.started.ns) if fact else "",
        ended=_iso(fact.ended.ns) if fact and fact.ended else "",
        duration_s=_duration_s(fact, scanned),
        counts=dict(scanned.counts),
        gaze_samples=scanned.samples,
        clocks=list(scanned.clocks.values()),
        attachments=scanned.attachments,
        metadata=scanned.metadata,
        checksum=checksum,
        complete=report.complete and ended,
        damaged=report.damaged,
        reason=report.reason or ("" if ended else "the session has not ended"),
    )


def _checksum(path: Path) -> str:
    try:
        return check(path).value
    except DamagedRecording:
        return "differs"


def _from_index(index: Index) -> _Scanned | None:
    """Return the summary from the index; None if the number of samples is only to be had by reading all of them."""
    counts = index.counts
    found = _Scanned(Counter(counts), metadata=index.metadata(), attachments=index.attachments)
    try:
        for message in index.messages(ABOUT_SESSION):
            found.add(message)
    except (DamagedRecording, MalformedMessage):
        return None
    if counts.get("gaze", 0) != sum(clock["chunks"] for clock in found.clocks.values()):
        return None  # a ledger counts what was applied; other chunks are recorded as well
    if found.session is None or found.session.ended is None:
        return None
    found.samples = sum(clock["samples"] for clock in found.clocks.values())
    found.library = index.library
    found.report = Report(True, reason="", messages=sum(counts.values()))
    return found


def _scanned(recording: Recording) -> _Scanned:
    found = _Scanned()
    try:
        for message in recording.messages():
            found.counts[message.topic] += 1
            found.first = found.first or message.log_time
            found.last = message.log_time
            if message.topic == "gaze":
                found.samples += len(json.loads(message.data)["t"])
            found.add(message)
    except (DamagedRecording, MalformedMessage, ValueError, KeyError, TypeError):
        pass  # the report has it
    found.library, found.report, found.metadata = recording.library, recording.report, recording.metadata
    found.attachments = {name: len(a.data) for name, a in recording.attachments.items()}
    return found


def _duration_s(fact: Session | None, scanned: _Scanned) -> float:
    if fact is not None and fact.ended is not None:
        return max(0, fact.ended.ns - fact.started.ns) / NS
    return max(0, scanned.last - scanned.first) / NS


def _iso(ns: int) -> str:
    """Return a time in ns as ISO 8601, UTC, with milliseconds."""
    return datetime.fromtimestamp(ns / NS, UTC).isoformat(timespec="milliseconds")
