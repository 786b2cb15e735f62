"""The error tree. Each error names the value, the rule that it broke, and whose fault it is. Pure.

An error crosses a boundary as a :class:`Problem`. ``Problem.of`` and ``Problem.error`` are inverses, so a service's
refusal arrives at the client as the same error.
"""

from __future__ import annotations

import re
from typing import Any, ClassVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError
from pydantic_core import ErrorDetails

from shift_schemas.ids import ID_PATTERN, is_id, not_an_id

VALUE_LENGTH = 80
"""How many characters of a refused value an error repeats: enough to find it, too few to echo an attack."""


class FieldError(BaseModel):
    """One thing wrong with one field."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    field: str = Field(description="Where, dotted: comprehension.duration_s.")
    value: str = Field(description="The value that was given, shortened.")
    rule: str = Field(description="The rule that it broke, and what to write instead.")


class ShiftError(Exception):
    """The root of the tree. ``kind`` is the error's name on the wire, ``status`` its HTTP status."""

    kind: ClassVar[str] = "internal"
    status: ClassVar[int] = 500
    title: ClassVar[str] = "Something went wrong inside"

    def __init__(self, detail: str, errors: tuple[FieldError, ...] = ()) -> None:
        super().__init__(detail)
        self.detail = detail
        self.errors = errors


class MalformedMessage(ShiftError):
    """The sender's fault: its message does not follow the rules."""

    kind = "malformed"
    status = 422
    title = "The message breaks a rule"


class InvalidStudy(MalformedMessage):
    """A study file or object with a mistake in it."""

    kind = "invalid-study"
    title = "The study has a mistake"

    def __init__(
        self, detail: str, errors: tuple[FieldError, ...] = (), sentences: tuple[str, ...] | None = None
    ) -> None:
        super().__init__(detail, errors)
        self.sentences = sentences or (detail,)
        """One sentence per mistake, each with file and line where the study is a file."""


class UnknownThing(ShiftError):
    """A session, task, decision or recording that does not exist."""

    kind = "unknown"
    status = 404
    title = "Not there"


class Conflict(ShiftError):
    """An id repeated with another content, a session that has ended, or a gaze source that was replaced."""

    kind = "conflict"
    status = 409
    title = "Contradicts what is there"


class TooLarge(ShiftError):
    """A body above the limit."""

    kind = "too-large"
    status = 413
    title = "Too large"


class Unavailable(ShiftError):
    """A service that does not answer, or cannot know yet. It states nothing about the thing that was asked for."""

    kind = "unavailable"
    status = 503
    title = "A service does not answer or does not know yet"


class InvalidSettings(ShiftError):
    """The user's fault at the start: a flag, variable or file of this installation."""

    kind = "invalid-settings"
    title = "The settings have a mistake"


class DamagedRecording(ShiftError):
    """A recording that cannot be read further, or that does not match its checksum."""

    kind = "damaged-recording"
    status = 422
    title = "The recording is damaged"


_KINDS: dict[str, type[ShiftError]] = {
    c.kind: c
    for c in (
        ShiftError, MalformedMessage, InvalidStudy, UnknownThing, Conflict, TooLarge, Unavailable,
        InvalidSettings, DamagedRecording,
    )
}  # fmt: skip


class Problem(BaseModel):
    """An error as it travels (the core of RFC 9457)."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    kind: str
    detail: str
    errors: tuple[FieldError, ...] = ()

    @classmethod
    def of(cls, error: ShiftError) -> Problem:
        """Return the form in which ``error`` travels."""
        return cls(kind=error.kind, detail=error.detail, errors=error.errors)

    def error(self) -> ShiftError:
        """Return the error that this problem was made from."""
        return _KINDS.get(self.kind, ShiftError)(self.detail, self.errors)


def shorten(value: Any) -> str:
    """Return ``value`` as text of at most ``VALUE_LENGTH`` printable characters, safe to repeat."""
    text = value if isinstance(value, str) else repr(value)
    text = "".join(c if c.isprintable() else "�" for c in text[: VALUE_LENGTH + 1])
    return text if len(text) <= VALUE_LENGTH else text[: VALUE_LENGTH - 1] + "…"


_BRANCH = re.compile(r"constrained-str|[a-z-]+\[.*\]", re.DOTALL)
"""Pydantic's names for the branch of a union or the key of a map, which are not fields of the sender."""


def field_errors(error: ValidationError, prefix: str = "") -> tuple[FieldError, ...]:
    """Return pydantic's errors as field errors, at most 20 of them."""
    found = []
    for e in error.errors(include_url=False)[:20]:
        names = [str(part) for part in e["loc"] if not _BRANCH.fullmatch(str(part))]
        field = ".".join([*([prefix] if prefix else []), *names]) or "body"
        missing = e["type"] == "missing"
        found.append(
            FieldError(
                field=shorten(field), value="" if missing else shorten(e["input"]), rule=id_mistake(e) or e["msg"]
            )
        )
    return tuple(found)


def id_mistake(error: ErrorDetails) -> str | None:
    """Return the sentence for a field that is not an id; None for another mistake. A pattern would not help anybody."""
    if error["type"] == "string_pattern_mismatch" and error.get("ctx", {}).get("pattern") == ID_PATTERN:
        return not_an_id(str(error["input"]))
    return None


def check_id(name: str, value: str) -> str:
    """Return ``value``. Raise :class:`MalformedMessage` with the rule and a proposal if it is not an id.

    ``name`` is the field, path part or flag that contains it.
    """
    if not is_id(value):
        rule = not_an_id(value)
        raise MalformedMessage(f"{name}: {rule}", (FieldError(field=name, value=shorten(value), rule=rule),))
    return value


def malformed(what: str, error: ValidationError) -> MalformedMessage:
    """Return a :class:`MalformedMessage` that says what is wrong with ``what``."""
    errors = field_errors(error)
    first = errors[0]
    return MalformedMessage(f"{what}: {first.field}: {first.rule}", errors)
