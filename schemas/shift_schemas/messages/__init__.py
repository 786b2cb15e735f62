"""The messages: facts, the gaze stream, commands and their answers, one file for each owner.

A fact is frozen, names what happened and has exactly one owner. Its ``subject`` is its key's last part
and the recording's topic. A ``None`` is left out of a recording, whose schemas have no unions.
"""

from __future__ import annotations

from shift_schemas.messages.base import (
    DEEPEST,
    MOST_WARNINGS,
    Command,
    Count,
    Fact,
    GazeOutcome,
    JsonObject,
    Message,
    Seconds,
    Seen,
    SessionEvent,
    SessionState,
    Strategy,
    Text,
    Warnings,
)
from shift_schemas.messages.decider import Decide, Decision, Estimate, Override, SetOverride, TripleView, Versions
from shift_schemas.messages.learner import (
    Performance,
    Policy,
    PolicyRow,
    ReportPerformance,
    Result,
    ScoredResult,
    Transition,
)
from shift_schemas.messages.mesh import Answer, Health, OutboxPage, OutboxQuery, OutboxRow
from shift_schemas.messages.monitor import AwarenessView, CapacityView, Fixation, Gaze, GazeChunk, GazeView, Observation
from shift_schemas.messages.recorder import (
    END_ID,
    FORMAT,
    START_ID,
    Config,
    Configure,
    EndSession,
    Mark,
    Marker,
    Session,
    StartSession,
)

__all__ = [
    "COMMANDS",
    "DEEPEST",
    "END_ID",
    "FACTS",
    "FORMAT",
    "MOST_WARNINGS",
    "START_ID",
    "Answer",
    "AwarenessView",
    "CapacityView",
    "Command",
    "Config",
    "Configure",
    "Count",
    "Decide",
    "Decision",
    "EndSession",
    "Estimate",
    "Fact",
    "Fixation",
    "Gaze",
    "GazeChunk",
    "GazeOutcome",
    "GazeView",
    "Health",
    "JsonObject",
    "Mark",
    "Marker",
    "Message",
    "Observation",
    "OutboxPage",
    "OutboxQuery",
    "OutboxRow",
    "Override",
    "Performance",
    "Policy",
    "PolicyRow",
    "ReportPerformance",
    "Result",
    "ScoredResult",
    "Seconds",
    "Seen",
    "Session",
    "SessionEvent",
    "SessionState",
    "SetOverride",
    "StartSession",
    "Strategy",
    "Text",
    "Transition",
    "TripleView",
    "Versions",
    "Warnings",
]

FACTS: dict[str, type[Fact]] = {
    f.subject: f
    for f in (
        Session, Config, Gaze, Fixation, Observation, Estimate, Decision, Override,
        Performance, Transition, Policy, Marker,
    )
}  # fmt: skip
"""Every fact by its subject, in the recording's order of topics."""


COMMANDS: dict[str, type[Command]] = {
    c.procedure: c for c in (StartSession, EndSession, Configure, Mark, Decide, SetOverride, ReportPerformance)
}
