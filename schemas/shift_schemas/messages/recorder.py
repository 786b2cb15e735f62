"""The recorder's messages: the session, its configuration and markers."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import Field

from shift_schemas.ids import Id
from shift_schemas.messages.base import Command, Count, Fact, JsonObject, SessionEvent, SessionState, Text, Warnings
from shift_schemas.timestamps import Stamp

FORMAT = 3
"""The format that a new session records in. A session keeps the format that it began with.

1: no shares of gaze, no warnings, no restarts. 2: an estimate is published only where it changes, and a decision does
not record what it required. 3: a configuration always publishes its estimates, and a decision records ``required``.
"""


class Session(Fact):
    """A session began, is ending or ended."""

    subject = "session"

    participant: Id = Field(description="Pseudonym of the participant.")
    study: Id = Field(description="The study's id.")
    condition: Id | None = Field(default=None, description="The study's condition; none: its own values.")
    seed: Annotated[int, Field(ge=0, lt=2**53)] = Field(description="Seed of every draw of the session.")
    state: SessionState = Field(description="live, ending (nothing is taken any more) or ended.")
    started: Stamp = Field(description="When it began.")
    ended: Stamp | None = Field(default=None, description="When it ended.")
    recording: str = Field(default="", description="Name of the finished recording.")
    sha256: str = Field(default="", description="Its checksum; empty within the recording itself.")
    counts: dict[str, Count] = Field(default={}, description="Messages of the session by topic.")
    replay_of: str = Field(default="", description="Name of the recording that this session replays.")
    software: str = Field(default="", description="Version of shift-mesh.")
    revision: str = Field(default="", description="Git revision of shift-mesh, where known.")
    format: Count = Field(default=1, description="Which facts and fields the session records; today 3.")
    warnings: Warnings = Field(default=[], description="What was accepted at its start and may not be meant.")


class Config(Fact):
    """The study in force, from here on."""

    subject = "config"

    version: Count = Field(ge=1, description="1 at the start, one more per change.")
    study: str = Field(description="The study in force as one JSON string.")


class Marker(Fact):
    """A note of the experimenter."""

    subject = "marker"

    marker_id: Id = Field(description="Its id.")
    text: Text = Field(description="What was noted.")


START_ID, END_ID = "start", "end"
"""Start and end have no id of their own: a session has one of each, and a repeat gets the first result."""


class StartSession(Command):
    """Begin a session."""

    procedure = "start_session"
    beside = frozenset({"need", "command_id", "format", "warnings"})

    participant: Id
    study: str | JsonObject = Field(default="default", description="A study's id, or the study itself.")
    seed: Annotated[int, Field(ge=0, lt=2**53)] | None = None
    condition: Id | None = None
    replay_of: str = ""
    software: str = ""
    revision: str = ""
    format: Count = FORMAT
    warnings: Warnings = Field(default=[], description="What was found when the study was read.")


class EndSession(Command):
    """End a session: nothing more is taken, the recording is finished."""

    procedure = "end_session"
    event: ClassVar[SessionEvent] = "end"


class Configure(Command):
    """Change the study in force by a JSON merge patch."""

    procedure = "configure"

    patch: JsonObject


class Mark(Command):
    """Note something in the recording."""

    procedure = "mark"

    text: Text
