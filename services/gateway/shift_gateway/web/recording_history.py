"""A recording's history: read in a process of its own, and handed to the gateway in small parts."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import aclosing
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from shift_recording.mcap.reader import Recording, fact_of
from shift_schemas.errors import ShiftError
from shift_schemas.lifecycle import has_ended
from shift_schemas.messages import Config, Fact
from shift_schemas.timestamps import NS
from shift_study.loading import study_from_json

from shift_gateway.web.history import Series, SessionHistory
from shift_gateway.web.recording_summary import reason_of
from shift_gateway.web.worker_process import Progress, Send, WorkFailed, parts_of

WORK = f"{__name__}:send_history"
PART = 300
"""Messages in one part: the gateway unpacks it within a few milliseconds. Chosen."""
NOT_SHOWN = ("fixation",)
"""Topics that no view shows."""


class SeriesPart(NamedTuple):
    """The next entries of one series of the history."""

    name: str
    times: list[int]
    items: list[Any]


class FileEnd(NamedTuple):
    """The file was read as far as it can be."""

    reason: str
    """Why it is not whole; empty if it is."""


@dataclass
class RecordingHistory:
    """The history of a recorded session, on a time line in seconds from its start."""

    history: SessionHistory = field(default_factory=lambda: SessionHistory(live=False))
    reason: str = ""
    """Why the recording is not complete, or how it is damaged."""
    _first: tuple[int, int] = (-1, 0)
    """The history's revision, and the beginning of its time line: every position is measured from it."""

    def add(self, part: SeriesPart | FileEnd) -> None:
        """Add what the process sent."""
        if isinstance(part, FileEnd):
            self.reason = part.reason
            return
        series = getattr(self.history, part.name)
        series.times += part.times
        series.items += part.items
        self.history.revision += len(part.items)

    @property
    def first_ns(self) -> int:
        """The beginning of the time line: the session's start, or the first message if the start is missing."""
        if self._first[0] != self.history.revision:
            self._first = (self.history.revision, _first_ns(self.history))
        return self._first[1]

    @property
    def length_s(self) -> float:
        """The length of the time line, seconds."""
        last = max((s.times[-1] for s in series_of(self.history).values() if len(s)), default=0)
        return max(last - self.first_ns, 0) / NS

    def at_ns(self, position_s: float) -> int:
        """Return the time at a position, ns since the epoch. The end includes the last message."""
        return self.first_ns + round(position_s * NS)

    def position_s(self, ns: int) -> float:
        """Return the position of a time, seconds."""
        return max(ns - self.first_ns, 0) / NS


def _first_ns(history: SessionHistory) -> int:
    session = history.session(0)
    firsts = [series.times[0] for series in series_of(history).values() if len(series)]
    return session.started.ns if session else min(firsts, default=0)


def series_of(history: SessionHistory) -> dict[str, Series[Any]]:
    """Return every series of the history by its name."""
    return {name: value for name, value in vars(history).items() if isinstance(value, Series)}


async def read_history(path: Path, into: RecordingHistory, on_progress: Callable[[float], None]) -> None:
    """Read a recording. ``on_progress`` gets the share of the file that was read, 0..1.

    What cannot be read is told in ``into.reason``; what came before it is there.
    """
    try:
        async with aclosing(parts_of(WORK, str(path))) as parts:
            async for part in parts:
                if isinstance(part, Progress):
                    on_progress(part.share)
                else:
                    into.add(part)
    except WorkFailed as e:
        into.reason = e.detail


def send_history(send: Send, path: str) -> None:
    """Read the file, and send its history, its progress and its end."""
    recording = Recording(Path(path))
    size = max(Path(path).stat().st_size, 1)
    sender = _Sender(send)
    error = ""
    try:
        for count, located in enumerate(recording.located(), start=1):
            message = located.message
            if message.topic not in NOT_SHOWN:
                sender.add(fact_of(message.topic, message.data))
            if count % PART == 0:
                sender.flush()
                send(Progress(located.chunk / size))
    except ShiftError as e:
        error = e.detail
    sender.flush()
    send(FileEnd(reason_of(recording, error) or sender.unfinished))


class _Sender:
    """Applies facts to a history, and sends what each series got since the last time."""

    def __init__(self, send: Send) -> None:
        self._send = send
        self._history = SessionHistory(live=False)
        self._ended = False
        self._sent: dict[str, int] = {}
        """By series, how many of its present entries were sent."""

    @property
    def unfinished(self) -> str:
        """That the session has not ended; empty if it has."""
        return "" if self._ended else "the session has not ended"

    def add(self, fact: Fact) -> None:
        """Apply one fact. Raises ``MalformedMessage`` for a study that cannot be read."""
        if isinstance(fact, Config):
            study_from_json(fact.study)
        self._history.apply(fact)

    def flush(self) -> None:
        """Send the new entries, and keep only each series' last one, which orders the next one."""
        session = self._history.session()
        self._ended = session is not None and has_ended(session.state)
        for name, series in series_of(self._history).items():
            first = self._sent.get(name, 0)
            if len(series) > first:
                self._send(SeriesPart(name, series.times[first:], series.items[first:]))
                del series.times[:-1], series.items[:-1]
                self._sent[name] = 1
