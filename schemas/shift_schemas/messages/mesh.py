"""Messages between a service and its readers: outbox pages, answers and health."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field

from shift_schemas.ids import Id
from shift_schemas.messages.base import Count, Message
from shift_schemas.timestamps import Stamp


class OutboxQuery(Message):
    """What a reader asks an owner: all facts after these cursors, and which sessions there are."""

    cursors: dict[Id, Count] = Field(default={}, description="Per session, the last sequence that was read.")
    limit: Annotated[int, Field(ge=1, le=10_000)] = 1000
    only: list[Id] | None = Field(default=None, description="Only these sessions; none: all.")
    closed: bool = Field(default=False, description="Sessions that ended as well.")


class OutboxRow(Message):
    """One fact in its owner's journal."""

    session: Id
    seq: Count
    subject: str
    payload: str = Field(description="The fact as JSON.")


class OutboxPage(Message):
    """The answer: rows in order, the heads of the sessions, and how far the owner itself has read."""

    owner: str
    rows: list[OutboxRow]
    heads: dict[Id, Count]
    cursors: dict[Id, dict[str, Count]] = Field(default={}, description="session -> owner -> sequence read.")
    complete: bool = Field(description="No more rows than these.")


class Answer(Message):
    """A command's or stream's reply: the acknowledgement."""

    owner: str = Field(description="The service that answered.")
    seq: Count = Field(description="The owner's sequence in this session with the effects of it.")
    repeat: bool = Field(default=False, description="It had been carried out before; this is the first result.")
    result: dict[str, Any]


class Health(Message):
    """A worker's own answer, through its own loop."""

    service: str = Field(description="The service that answers.")
    ready: bool = Field(description="It has read every journal that it needs, and the disk takes its own.")
    detail: str = Field(default="", description="What it waits for.")
    sessions: Count = Field(default=0, description="Sessions in memory.")
    unreached: list[str] = Field(default=[], description="Owners that it reads and that have not answered it lately.")
    mesh: str = Field(default="", description="Id of its data folder: two owners under one key differ in it.")
    since: Stamp | None = Field(default=None, description="When its process began.")
    data: str = Field(default="", description="Its data folder.")
