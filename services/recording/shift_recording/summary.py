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
from shift_schemas.messages import Session
from shift_schemas.timestamps import NS

from shift_recording.checksum import check
from shift_recording.mcap.reader import Recording, fact_of
from shift_recording.mcap.writer import SESSION_METADATA


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
    """The ledger of each gaze source (topic ``clock``); empty before the session's end, and before format 5."""
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
    """The result of one pass over the file."""

    counts: Counter[str]
    first: int = 0
    last: int = 0
    session: Session | None = None
    samples: int = 0
    clocks: list[dict[str, Any]] = field(default_factory=list)


def info_of(path: Path) -> RecordingInfo:
    """Read a recording once. A damaged or truncated recording is summarised as far as it can be read.

    Raises
    ------
    UnknownThing
        The file does not exist.
    """
    checksum = _checksum(path)
    recording = Recording(path)
    scanned = _scanned(recording)
    said, fact, report = recording.metadata.get(SESSION_METADATA, {}), scanned.session, recording.report
    ended = fact is not None and has_ended(fact.state)
    return RecordingInfo(
        file=path.name,
        bytes=path.stat().st_size,
        library=recording.library,
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
        clocks=scanned.clocks,
        attachments={name: len(a.data) for name, a in recording.attachments.items()},
        metadata=recording.metadata,
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


def _scanned(recording: Recording) -> _Scanned:
    found = _Scanned(Counter())
    try:
        for message in recording.messages():
            found.counts[message.topic] += 1
            found.first = found.first or message.log_time
            found.last = message.log_time
            if message.topic == "gaze":
                found.samples += len(json.loads(message.data)["t"])
            if message.topic == "clock":
                fact = fact_of(message.topic, message.data)
                found.clocks.append(fact.model_dump(mode="json", exclude={"session", "stamp", "seen"}))
            if message.topic == "session":
                fact = fact_of(message.topic, message.data)
                found.session = fact if isinstance(fact, Session) else found.session
    except (DamagedRecording, MalformedMessage, ValueError, KeyError, TypeError):
        pass  # the report has it
    return found


def _duration_s(fact: Session | None, scanned: _Scanned) -> float:
    if fact is not None and fact.ended is not None:
        return max(0, fact.ended.ns - fact.started.ns) / NS
    return max(0, scanned.last - scanned.first) / NS


def _iso(ns: int) -> str:
    """Return a time in ns as ISO 8601, UTC, with milliseconds."""
    return datetime.fromtimestamp(ns / NS, UTC).isoformat(timespec="milliseconds")
