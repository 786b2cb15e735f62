"""What the start page shows: the services and the equipment before a session, and the sessions. Pure."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

from shift_runtime.study_files import CheckedStudy
from shift_schemas.messages import Health
from shift_schemas.timestamps import NS, Stamp

from shift_gateway.web.gaze_quality import Level, SourceQuality
from shift_gateway.web.wording import clock_time, date_and_time, duration

GB = 1e9
DISK_WARNING_GB, DISK_FAULT_GB = 5.0, 1.0
"""Less free room is a warning, and a fault; chosen: an hour of gaze at 120 Hz needs about 0.1 GB."""
LAG_WARNING = 500
"""More messages that the recorder has not read yet are a warning; chosen: it reads several thousand a second."""


class Check(NamedTuple):
    """One line of the pre-flight list."""

    name: str
    level: Level
    sentence: str
    heard_ns: int | None
    """When it was last heard, ns since the epoch; None if never."""

    @property
    def text(self) -> str:
        """The line as it is shown."""
        heard = f" Last heard at {clock_time(self.heard_ns)}." if self.heard_ns is not None else " Not heard yet."
        return f"{self.level}: {self.sentence}{heard}"


def service_check(name: str, health: Health | None, heard_ns: int | None) -> Check:
    """Return the check of one service from its newest answer; None if it does not answer now."""
    if health is None:
        return Check(name, "fault", f"The {name} does not answer; see its log, or start the mesh again.", heard_ns)
    if not health.ready:
        return Check(name, "warning", f"The {name} is not ready: {health.detail or 'it still reads'}.", heard_ns)
    sessions = "1 session" if health.sessions == 1 else f"{health.sessions} sessions"
    return Check(name, "ok", f"The {name} is ready, with {sessions} in memory.", heard_ns)


def lag_check(behind: int | None, now_ns: int) -> Check:
    """Return the check of how many messages the recorder has not read yet; None if it is not known."""
    if behind is None:
        return Check("lag", "warning", "It is not known how far the recorder has read.", None)
    level: Level = "ok" if behind < LAG_WARNING else "warning"
    messages = "1 message" if behind == 1 else f"{behind} messages"
    return Check("lag", level, f"The recorder has {messages} to read.", now_ns)


def disk_check(free: int, total: int, now_ns: int) -> Check:
    """Return the check of the disk that holds the data folder; ``free`` and ``total`` are in bytes."""
    free_gb = free / GB
    level: Level = "fault" if free_gb < DISK_FAULT_GB else "warning" if free_gb < DISK_WARNING_GB else "ok"
    advice = "" if level == "ok" else " Make room before the next session."
    return Check("disk", level, f"{free_gb:.1f} GB of {total / GB:.0f} GB are free for recordings.{advice}", now_ns)


def source_check(session: str, quality: SourceQuality, now_ns: int) -> Check:
    """Return the check of one gaze source of a session."""
    figures = quality.text.removeprefix(f"{quality.level} ")
    sentence = f"Gaze source {quality.source} of session {session}: {figures}. {quality.sentence}"
    return Check(quality.source, quality.level, sentence, now_ns - int(quality.age_s * NS))


def proposed_participant(known: Iterable[str]) -> str:
    """Return the next free pseudonym of the form P01; random ones are as good, and any id is a participant."""
    numbers = [int(found[1]) for name in known if (found := re.fullmatch(r"P(\d{1,6})", name))]
    return f"P{max(numbers, default=0) + 1:02}"


class StudyChoice(NamedTuple):
    """A study in the start form."""

    name: str
    label: str
    conditions: tuple[str, ...]
    startable: bool
    remarks: tuple[str, ...]
    """Its mistakes and warnings, one sentence each."""


def study_choice(found: CheckedStudy) -> StudyChoice:
    """Return a study as the form offers it."""
    label = f"{found.name}: {found.title}" if found.title else found.name
    if found.study is None:
        return StudyChoice(found.name, f"{label} (has mistakes)", (), False, found.mistakes)
    return StudyChoice(found.name, label, tuple(found.study.conditions), True, found.warnings)


def session_row(session: Mapping[str, Any], blinded: bool, now_ns: int) -> dict[str, Any]:
    """Return a row of the sessions' table, from the session as REST shows it.

    ``blinded`` is whether its study hides the condition while the session runs.
    """
    started = Stamp(**session["started"]).ns
    ended = Stamp(**session["ended"]).ns if session["ended"] else now_ns
    hidden = blinded and session["state"] != "ended"
    return {
        "session": session["session"],
        "participant": session["participant"],
        "study": session["study"],
        "condition": "blinded" if hidden else session["condition"] or "none",
        "state": session["state"],
        "started": date_and_time(started),
        "started_ns": str(started),
        "duration": duration((ended - started) / NS),
        "decisions": session["counts"].get("decision", 0),
        "results": session["counts"].get("performance", 0),
        "recording": session["recording"],
    }
