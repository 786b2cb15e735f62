"""Messages between a service and its readers: outbox pages, answers and health."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field

from shift_schemas.ids import Id
from shift_schemas.messages.base import Count, Message
from shift_schemas.timestamps import Stamp


class OutboxQuery(Message):
    """A reader's question to an owner: all facts after these cursors, and which sessions exist."""

    cursors: dict[Id, Count] = Field(default={}, description="Per session, the last sequence that was read.")
    limit: Annotated[int, Field(ge=1, le=10_000)] = 1000
    only: list[Id] | None = Field(default=None, description="Only these sessions; left out: all.")
    closed: bool = Field(default=False, description="Include sessions that have ended.")
    current: bool = Field(
        default=False, description="Publish first what the owner holds back of the sessions in `only`."
    )


class OutboxRow(Message):
    """One fact in its owner's journal."""

    session: Id
    seq: Count
    subject: str
    payload: str = Field(description="The fact as JSON.")


class OutboxPage(Message):
    """An owner's answer: rows in order, the heads of the sessions, and how far the owner itself has read."""

    owner: str
    rows: list[OutboxRow]
    heads: dict[Id, Count]
    cursors: dict[Id, dict[str, Count]] = Field(default={}, description="session -> owner -> sequence read.")
    complete: bool = Field(description="Whether these are all rows.")


class Answer(Message):
    """The reply to a command or a stream's item: it is stored."""

    owner: str = Field(description="The service that answered.")
    seq: Count = Field(description="The owner's sequence in this session that includes its effects.")
    repeat: bool = Field(default=False, description="It was carried out before; this is the first result.")
    result: dict[str, Any]


class Health(Message):
    """The health of a service, answered by the loop that does its work."""

    service: str = Field(description="The service that answers.")
    ready: bool = Field(description="It has read every journal that it needs, and can write its own.")
    detail: str = Field(default="", description="Why it is not ready.")
    sessions: Count = Field(default=0, description="Sessions in memory.")
    unreached: list[str] = Field(default=[], description="Owners that it reads and that do not answer it.")
    mesh: str = Field(default="", description="Id of its data folder; it tells two services of the same name apart.")
    since: Stamp | None = Field(default=None, description="When its process began.")
    data: str = Field(default="", description="Its data folder.")


class ReplayStatus(Message):
    """How far a replay is; it is published while the replay runs."""

    session: Id = Field(description="The session under which the recording is replayed.")
    recording: str = Field(description="The file.")
    inputs: bool = Field(default=False, description="Only inputs are replayed, and the mesh decides anew.")
    position_s: float = Field(description="Position on the recording's time line, s.")
    length_s: float = Field(description="Its length, s.")
    rate: float = Field(description="Recorded seconds in a second.")
    paused: bool
    published: Count = Field(description="How many messages were replayed.")


class ReplayControl(Message):
    """What a replay is to do; what is left out stays as it is."""

    paused: bool | None = Field(default=None, description="Pause or continue.")
    rate: Annotated[float, Field(gt=0, le=10_000)] | None = Field(
        default=None, description="Recorded seconds a second."
    )
    position_s: Annotated[float, Field(ge=0, le=1e9)] | None = Field(default=None, description="Go on from here, s.")
    step: bool = Field(default=False, description="Pause, and replay one more message.")
    stop: bool = Field(default=False, description="End the replay.")
