"""The base of all messages: field types, facts, streams, commands, and how far somebody has read.

A message declares on its class who owns it and where it travels. :mod:`shift_schemas.registry` derives every table from
these declarations: to add a fact or a command, add its class to the file of its owner.
"""

from __future__ import annotations

import inspect
from math import isfinite
from typing import Annotated, Any, ClassVar, Literal, NamedTuple

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from shift_schemas.ids import Id
from shift_schemas.timestamps import Stamp

Strategy = dict[str, str]
Count = Annotated[int, Field(ge=0, le=2**53)]
SessionState = Literal["live", "ending", "ended"]
SessionEvent = Literal["input", "end", "finish"]
"""What a command means for the lifecycle of its session: see :mod:`shift_schemas.lifecycle`."""
GazeOutcome = Literal["applied", "late"]
Seconds = Annotated[float, Field(ge=-1e11, le=1e11)]
Text = Annotated[str, Field(max_length=10_000)]
Author = Annotated[str, Field(max_length=100)]
"""The name of the person who made a change, as they gave it; empty: not given."""
MOST_WARNINGS = 100
Warnings = Annotated[list[str], Field(max_length=MOST_WARNINGS)]
DEEPEST = 32
"""The deepest nesting of a plain JSON object within a message; a study has 6 levels."""


def _plain(value: dict[str, Any]) -> dict[str, Any]:
    """Refuse what JSON cannot repeat: infinite numbers (``1e999`` is one), lone surrogates, unlimited nesting."""
    level: list[Any] = [value]
    for _ in range(DEEPEST):
        if any(isinstance(v, float) and not isfinite(v) for v in level):
            raise ValueError("a number must be finite")
        if any(isinstance(v, str) and not v.isascii() and any("\ud800" <= c <= "\udfff" for c in v) for v in level):
            raise ValueError("half of a character (a lone surrogate) is not text")
        inner = [v for v in level if isinstance(v, (dict, list))]
        level = [w for v in inner for w in ((*v, *v.values()) if isinstance(v, dict) else v)]
        if not level:
            return value
    raise ValueError(f"it is nested deeper than {DEEPEST} levels")


JsonObject = Annotated[dict[str, Any], AfterValidator(_plain)]
"""Any JSON object that can be written as JSON again."""


class Message(BaseModel):
    """Anything that travels."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)


class Seen(Message):
    """How far the sender had read each of its inputs; as ``need``, how far the answerer must have read them."""

    gaze: dict[Id, Count] = Field(default={}, description="Per source, the last chunk's number.")
    decision: Count = Field(default=0, description="Number of the last decision.")
    performance: Count = Field(default=0, description="Number of the last performance.")
    config: Count = Field(default=0, description="Version of the configuration.")
    observation: Count = Field(default=0, description="Version of the observation.")
    policy: Count = Field(default=0, description="Version of the policy.")


class Fact(Message):
    """An event that happened, published by its one owner."""

    owner: ClassVar[str]
    """The service that publishes it."""
    subject: ClassVar[str]
    """The last part of its key, and the recording's topic."""
    number: ClassVar[str] = ""
    """The field that counts the facts of this subject in a session, as :class:`Seen` counts them; empty: none."""
    listed_last: ClassVar[bool] = False
    """Whether its topic follows the topics of all other owners."""

    session: Id = Field(description="The session that it belongs to.")
    stamp: Stamp = Field(description="When its owner made it, wall clock. The owner's sequence defines the order.")
    seen: Seen = Field(default=Seen(), description="How far its owner had read its inputs.")


class StreamItem(Message):
    """One item of a stream into a service; the service numbers repeats by the item's own number."""

    owner: ClassVar[str]
    """The service that receives the stream."""
    stream: ClassVar[str]
    """The last part of its key."""


class RestRoute(NamedTuple):
    """The REST path of a command."""

    method: Literal["POST", "PATCH"]
    path: str
    status: int = 201
    """The HTTP status of a first answer; a repeat is answered with 200."""
    tag: str = "interaction"
    """The path's group in the documentation."""
    name: str = ""
    """The path's name in the documentation; empty: the procedure's."""
    media_types: tuple[str, ...] = ("application/json",)
    """The content types of the body in the documentation; empty: the path needs no body and ignores one."""


class RepeatWording(NamedTuple):
    """The words for a command whose id was used before with another content (:mod:`shift_schemas.conflicts`).

    ``{id}`` is the command's id, ``{session}`` its session, ``{procedure}`` its procedure.
    """

    first: str
    """What the first command did."""
    again: str
    """What the command is called."""
    remedy: str


class Command(Message):
    """A request to the owner of a fact. ``command_id`` names it: a repeat gets the first result."""

    owner: ClassVar[str]
    """The service that carries it out."""
    procedure: ClassVar[str]
    """The last part of its key."""
    event: ClassVar[SessionEvent] = "input"
    """What the command means for the lifecycle of its session."""
    result: ClassVar[type[Fact] | None] = None
    """The fact that it makes. If the fact has a number, the answer has the same one, and later requests require it."""
    wait_s: ClassVar[float | None] = 0.0
    """How long its owner may wait for missing inputs, seconds; None: the study's ``decider.wait_s``."""

    route: ClassVar[RestRoute | None] = None
    """Its REST path; None: REST has none."""
    fixed_id: ClassVar[str] = ""
    """The command id of a command that a session has only once; empty: each one has its own."""
    id_field: ClassVar[str] = ""
    """The body's field in which a client may give the command id; empty: it cannot."""
    id_prefix: ClassVar[str] = "c-"
    """The beginning of a command id that the client leaves out."""
    internal: ClassVar[frozenset[str]] = frozenset()
    """Fields that the body does not have: the services fill them in."""
    body: ClassVar[type[BaseModel] | None] = None
    """The model of the body, if it cannot be derived from the fields (:mod:`shift_schemas.requests`)."""
    wording: ClassVar[RepeatWording] = RepeatWording(
        "{procedure} {id} was asked before", "request", "Choose another id for another request"
    )
    """The words of its refusal, if its id was used before with another content."""
    not_content: ClassVar[frozenset[str]] = frozenset({"need", "command_id"})
    """Fields that a repeat may have otherwise."""
    added: ClassVar[frozenset[str]] = frozenset()
    """Fields that earlier versions did not have. They are no content while they are left out, so that a repeat after an
    update still equals the first command."""
    query_fields: ClassVar[frozenset[str]] = frozenset()
    """Fields that REST reads from the address (``?author=Anna``), because the body cannot have them."""

    command_id: Id
    session: Id
    need: Seen = Field(
        default=Seen(), description="What the answerer must have read, so that you read your own writes."
    )

    def content(self) -> str:
        """Return what a repeat must be equal in: everything but what the sender had read by then."""
        absent = {name for name in self.added if getattr(self, name) == type(self).model_fields[name].default}
        return self.model_dump_json(exclude={*self.not_content, *absent})

    @classmethod
    def body_fields(cls) -> tuple[str, ...]:
        """Return the names of the fields that the body has from the command, in the order of their declaration."""
        return tuple(n for n in inspect.get_annotations(cls) if n in cls.model_fields and n not in cls.internal)

    @classmethod
    def id_in(cls, body: Any) -> str | None:
        """Return the command id that a body gives; None if a new one is to be made."""
        return cls.fixed_id or (getattr(body, cls.id_field) if cls.id_field else None)

    @classmethod
    def fields_in(cls, body: Any) -> dict[str, Any]:
        """Return the command's own fields as a body gives them."""
        return {name: getattr(body, name) for name in cls.body_fields() if name not in Command.model_fields}

    @classmethod
    def answer_in(cls, result: dict[str, Any]) -> dict[str, Any]:
        """Return the owner's result as REST shows it."""
        return result
