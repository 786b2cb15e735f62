"""The recorder's messages: the session, its configuration and markers."""

from __future__ import annotations

import json
from typing import Annotated, Any, ClassVar

from pydantic import AfterValidator, BeforeValidator, Field, RootModel

from shift_schemas.ids import Id
from shift_schemas.messages.base import (
    Author,
    Command,
    Count,
    Fact,
    JsonObject,
    RepeatWording,
    RestRoute,
    SessionEvent,
    SessionState,
    Text,
    Warnings,
)
from shift_schemas.shared_text import shared
from shift_schemas.timestamps import Stamp

FORMAT = 6
"""The format that a new session records in. A session keeps the format that it began with.

1: no shares of gaze, no warnings, no restarts. 2: an estimate is published only where it changes, and a decision does
not record what it required. 3: a configuration always publishes its estimates, and a decision records ``required``.
4: an observation follows a chunk of gaze only where its class or its warnings change, after 250 ms of the source's
time, or where somebody needs it. 5: an overridden decision records what SHIFT would have chosen, and the ledgers of
the sources are recorded. 6: AOIs can move, a fixation lists every AOI that it fell on, a decision names the age and
the validity of its gaze, a jump of a source's clock begins a segment, and a ledger lists its segments and is recorded
while the session runs.
"""


MOST_COVARIATES = 32


def _covariate_text(value: object) -> object:
    """Return a number or a truth value as JSON writes it; everything else stays."""
    return json.dumps(value) if isinstance(value, bool | int | float) else value


CovariateText = Annotated[str, Field(max_length=200)]
Covariate = Annotated[
    CovariateText, BeforeValidator(_covariate_text, json_schema_input_type=CovariateText | float | bool)
]
"""A text, a number or a truth value, kept as text."""


class Session(Fact):
    """A session began, is ending or ended."""

    owner = "recorder"
    subject = "session"

    participant: Id = Field(description="Pseudonym of the participant.")
    study: Id = Field(description="The study's id.")
    condition: Id | None = Field(default=None, description="The study's condition; left out: the study's own values.")
    seed: Annotated[int, Field(ge=0, lt=2**53)] = Field(description="Seed of all random numbers of the session.")
    state: SessionState = Field(description="live, ending (it accepts no more input) or ended.")
    started: Stamp = Field(description="When it began.")
    ended: Stamp | None = Field(default=None, description="When it ended.")
    recording: str = Field(default="", description="Name of the finished recording.")
    sha256: str = Field(default="", description="Its checksum; empty within the recording itself.")
    counts: dict[str, Count] = Field(default={}, description="Messages of the session by topic.")
    replay_of: str = Field(default="", description="Name of the recording that this session replays.")
    software: str = Field(default="", description="Version of shift-mesh.")
    revision: str = Field(default="", description="Git revision of shift-mesh, where known.")
    shard: str = Field(default="", description="The shard of a mesh with several, such as 0/4; it never changes.")
    format: Count = Field(default=1, description="Which facts and fields the session records; today 6.")
    warnings: Warnings = Field(default=[], description="What was accepted at its start but may be a mistake.")
    covariates: dict[Id, CovariateText] = Field(default={}, description="What was given about the participant.")


class Config(Fact):
    """The study in force, from here on."""

    owner = "recorder"
    subject = "config"
    number = "version"

    version: Count = Field(ge=1, description="1 at the start; each change adds 1.")
    study: Annotated[str, AfterValidator(shared)] = Field(description="The study in force as one JSON string.")
    author: Author = Field(default="", description="Who changed it, if the name was given.")


class Marker(Fact):
    """A note of the experimenter."""

    owner = "recorder"
    subject = "marker"
    listed_last = True

    marker_id: Id = Field(description="Its id.")
    text: Text = Field(description="The note.")
    retracts: str = Field(default="", description="The earlier marker that this one retracts; '' is none.")
    author: Author = Field(default="", description="Who set it, if the name was given.")


RESERVED = frozenset(Session.model_fields) | {"file", "complete", "incomplete_reason", "duration_s"}
"""The columns of the exported table of sessions; a covariate must not take their places."""


def _check_names(covariates: dict[str, str]) -> dict[str, str]:
    if taken := [name for name in covariates if name in RESERVED]:
        raise ValueError(f"{taken[0]} is a column of the exported table already; choose another name")
    return covariates


START_ID, END_ID = "start", "end"
"""Start and end have fixed ids: a session has one of each, and a repeat gets the first result."""


class StartSession(Command):
    """Begin a session. The same start again gets the first result."""

    owner = "recorder"
    procedure = "start_session"
    result = Session
    route = RestRoute("POST", "/v1/sessions", tag="sessions")
    fixed_id = START_ID
    id_field = "session"
    wording = RepeatWording("session {session} is there already", "start", "Choose another session id")
    internal = frozenset({"replay_of", "software", "revision", "shard", "format", "warnings"})
    not_content = frozenset({"need", "command_id", "shard", "format", "warnings"})
    added = frozenset({"covariates"})

    participant: Id = Field(description="Pseudonym of the participant.")
    session: Id = Field(description="Left out: a new id.")
    study: Id | JsonObject = Field(default="default", description="A study's name, or the study itself.")
    seed: Annotated[int, Field(ge=0, lt=2**53)] | None = Field(default=None, description="Left out: from the id.")
    condition: Id | None = Field(default=None, description="Left out: the study's own values.")
    covariates: Annotated[dict[Id, Covariate], Field(max_length=MOST_COVARIATES), AfterValidator(_check_names)] = Field(
        default={}, description="What is known of the participant, such as age and group; columns of exported tables."
    )
    replay_of: str = ""
    software: str = ""
    revision: str = ""
    shard: str = ""
    format: Count = FORMAT
    warnings: Warnings = Field(default=[], description="What was found when the study was read.")


class EndSession(Command):
    """End a session; answered once its recording is finished. It needs no body and ignores one."""

    owner = "recorder"
    procedure = "end_session"
    event: ClassVar[SessionEvent] = "end"
    wait_s = 10.0
    route = RestRoute("POST", "/v1/sessions/{session}/end", 200, "sessions", media_types=())
    fixed_id = END_ID
    wording = RepeatWording("the end of session {session} was asked for before", "end", "Send it again unchanged")


class PatchBody(RootModel[JsonObject]):
    """Change the study in force: a JSON merge patch (RFC 7386) of it."""


class Configure(Command):
    """Change the study in force by a JSON merge patch (RFC 7386)."""

    owner = "recorder"
    procedure = "configure"
    result = Config
    route = RestRoute(
        "PATCH", "/v1/sessions/{session}/config", 200, "configuration", "patch_config",
        ("application/merge-patch+json", "application/json"),
    )  # fmt: skip
    body = PatchBody
    wording = RepeatWording("change {id} was made before", "change", "Choose another id for another change")
    added = frozenset({"author"})
    query_fields = frozenset({"author"})

    patch: JsonObject
    author: Author = Field(default="", description="Your name, for the list of changes.")

    @classmethod
    def fields_in(cls, body: Any) -> dict[str, Any]:
        """Return the whole body as the patch."""
        return {"patch": body.root}


class Mark(Command):
    """Note something in the recording."""

    owner = "recorder"
    procedure = "mark"
    result = Marker
    route = RestRoute("POST", "/v1/sessions/{session}/markers")
    id_field = "marker_id"
    id_prefix = "m-"
    wording = RepeatWording("marker {id} was set before", "marker", "Choose another marker_id for another marker")
    added = frozenset({"retracts", "author"})

    text: Text
    retracts: Id | None = Field(default=None, description="The id of an earlier marker that was a mistake.")
    author: Author = Field(default="", description="Your name, for the list of changes.")
