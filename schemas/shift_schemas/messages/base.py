"""What every message shares: field types, facts, commands and what was seen."""

from __future__ import annotations

from math import isfinite
from typing import Annotated, Any, ClassVar, Literal

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


MOST_WARNINGS = 100


Warnings = Annotated[list[str], Field(max_length=MOST_WARNINGS)]


DEEPEST = 32
"""Nesting of a plain JSON object within a message; a study has 6."""


def _plain(value: dict[str, Any]) -> dict[str, Any]:
    """Refuse what JSON cannot say back: infinite numbers (``1e999`` is one), half characters, bottomless nesting."""
    level: list[Any] = [value]
    for _ in range(DEEPEST):
        if any(isinstance(v, float) and not isfinite(v) for v in level):
            raise ValueError("a number must be finite")
        if any(isinstance(v, str) and not v.isascii() and any("\ud800" <= c <= "\udfff" for c in v) for v in level):
            raise ValueError("half of a character (a lone surrogate) is no text")
        inner = [v for v in level if isinstance(v, (dict, list))]
        level = [w for v in inner for w in ((*v, *v.values()) if isinstance(v, dict) else v)]
        if not level:
            return value
    raise ValueError(f"it is nested deeper than {DEEPEST} levels")


JsonObject = Annotated[dict[str, Any], AfterValidator(_plain)]
"""A JSON object as it came, of which only is known that it can be said back."""


class Message(BaseModel):
    """Anything that travels."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)


class Seen(Message):
    """How far the sender had read each of its inputs; as ``need``, how far the answerer must have."""

    gaze: dict[Id, Count] = Field(default={}, description="Per source, the last chunk's number.")
    decision: Count = Field(default=0, description="Number of the last decision.")
    performance: Count = Field(default=0, description="How many performances.")
    config: Count = Field(default=0, description="Version of the configuration.")
    observation: Count = Field(default=0, description="Version of the observation.")
    policy: Count = Field(default=0, description="Version of the policy.")


class Fact(Message):
    """What happened, put out by its one owner."""

    subject: ClassVar[str]

    session: Id = Field(description="The session it belongs to.")
    stamp: Stamp = Field(description="When its owner made it, wall clock; order is by the owner's sequence.")
    seen: Seen = Field(default=Seen(), description="How far its owner had read its inputs.")


class Command(Message):
    """What a door asks of a fact's owner. ``command_id`` names it: a repeat gets the first result."""

    procedure: ClassVar[str]
    event: ClassVar[SessionEvent] = "input"
    """What the command means for the lifecycle of its session."""

    command_id: Id
    session: Id
    need: Seen = Field(default=Seen(), description="What the answerer must have seen: read your own writes.")

    beside: ClassVar[frozenset[str]] = frozenset({"need", "command_id"})
    """Fields that do not make it another command."""

    def content(self) -> str:
        """What makes a repeat a repeat: everything but what the door had seen by then."""
        return self.model_dump_json(exclude=set(self.beside))
