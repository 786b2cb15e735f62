"""What the table of recordings shows: one row a session. Pure."""

from __future__ import annotations

from typing import Any

from shift_recording.exclusion import Exclusion
from shift_schemas.timestamps import NS

from shift_gateway.web.recording_summary import RecordingSummary
from shift_gateway.web.wording import date_and_time, duration

BLINDED = "blinded"
"""The condition of a blinded study. A session that has ended still tells which condition comes next in a study that is
being collected, so that it stays hidden until somebody asks for it."""
COLUMNS = (
    ("recording", "Recording", "The file in data/recordings; its name is the session's."),
    ("participant", "Participant", "The pseudonym."),
    ("study", "Study", "The study that the session began with."),
    ("condition", "Condition", "The variant of the study. A blinded study hides it here as well."),
    ("started", "Started", "Date and time on this machine."),
    ("duration", "Duration", "From the session's start to its end, minutes and seconds."),
    ("decisions", "Decisions", "Explanations that were decided."),
    ("lost", "Gaze lost, %", "Share of the gaze source's time without a valid sample (docs: model)."),
    ("overrides", "Overrides", "Decisions that followed the experimenter, not the policy."),
    ("stale", "Stale", "Decisions that were made before all earlier data was processed (docs: glossary)."),
    ("changes", "Changes", "Changes of the study during the session."),
    ("state", "State", "Whether the file is whole and its session ended."),
    ("exclusion", "Exclusion", "Whether the recording is left out of the analysis, why, by whom and when."),
)
"""Name, label and explanation of each column."""
NO_STATISTICS = (
    "This page shows no means of groups and no significance: what is seen of a study while it is being collected "
    "changes how it is collected and when it is stopped."
)


def recording_row(summary: RecordingSummary, exclusion: Exclusion | str, unblinded: bool) -> dict[str, Any]:
    """Return a row of the table: each column's plain value, and the keys that it is sorted by.

    ``exclusion`` is a text if the exclusion's file cannot be read. ``unblinded`` shows the conditions of blinded
    studies.
    """
    over = summary.ended_ns - summary.started_ns if summary.ended_ns else 0
    in_force = exclusion.in_force if isinstance(exclusion, Exclusion) else None
    return {
        "recording": summary.name,
        "participant": summary.participant,
        "study": summary.study,
        "condition": condition_of(summary, unblinded),
        "started": date_and_time(summary.started_ns) if summary.started_ns else "",
        "duration": duration(over / NS) if over else "",
        "decisions": summary.decisions,
        "lost": "" if summary.lost is None else round(100 * summary.lost, 1),
        "overrides": summary.overrides,
        "stale": summary.stale,
        "changes": summary.changes,
        "state": summary.reason or "complete",
        "whole": not summary.reason,
        "exclusion": exclusion_text(exclusion),
        "excluded": in_force is not None,
    }


def condition_of(summary: RecordingSummary, unblinded: bool = False) -> str:
    """Return the condition as it may be shown; empty if the session has none."""
    return BLINDED if summary.blinded and summary.condition and not unblinded else summary.condition


def exclusion_text(exclusion: Exclusion | str) -> str:
    """Return who excluded the recording, when and why; empty if it is not excluded."""
    if isinstance(exclusion, str):
        return exclusion
    entry = exclusion.in_force
    return f"{entry.reason} ({entry.author}, {date_and_time(entry.time.ns)})" if entry else ""
