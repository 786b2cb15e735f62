"""Map the JSON in ROS messages to messages of the mesh and back, strictly. Pure.

The fields are those of docs/interface.md. Each message may carry ``session``. A single gaze sample has plain values
where a chunk has lists. Errors are :class:`MalformedMessage` with field, value and rule.
"""

from __future__ import annotations

import json
from typing import Any, NamedTuple, TypeVar

from pydantic import BaseModel, Field, TypeAdapter, ValidationError
from pydantic_core import to_json
from shift_schemas.errors import (
    FieldError,
    MalformedMessage,
    Problem,
    ShiftError,
    TooLarge,
    id_mistake,
    malformed,
    shorten,
)
from shift_schemas.ids import Id
from shift_schemas.messages import AoiPositions, Fact, GazeChunk, Message, Observation
from shift_schemas.requests import PerformanceBody
from shift_schemas.strict_json import parse_json
from shift_sources.gaze_batching import COLUMNS, GazeArrival

TEXT_LIMIT = 256 * 1024
"""Bytes of one message; the gateway has the same limit."""
UNNUMBERED = 0
M = TypeVar("M", bound=BaseModel)
_ID: TypeAdapter[str] = TypeAdapter(Id)


class TaskMessage(Message):
    """The task of the next request."""

    session: Id | None = None
    task: Id = Field(description="The task that is to be explained.")


class PerformanceMessage(PerformanceBody):
    """The report of a task's performance."""

    session: Id | None = None

    @property
    def body(self) -> PerformanceBody:
        """Return the report without its session."""
        return PerformanceBody(
            decision_id=self.decision_id, comprehension=self.comprehension, enabledness=self.enabledness
        )


def gaze_of(text: str, source: str, now_s: float) -> GazeArrival:
    """Return a chunk, or a single sample as a chunk of one.

    Parameters
    ----------
    source
        The source if the message names none.
    now_s
        The time of a single sample without ``t``, in seconds of the bridge's clock.
    """
    data = _object("gaze", text)
    session = data.pop("session", None)
    if session is not None:
        _checked_id("session", session)
    numbered = data.get("seq") is not None
    sample = not isinstance(data.get("t"), list)
    if sample:
        data.setdefault("t", now_s)
        data = {k: [v] if k in COLUMNS else v for k, v in data.items()}
    data = {**data, "source": data.get("source", source), "seq": data["seq"] if numbered else UNNUMBERED}
    try:
        chunk = GazeChunk.model_validate(data)
    except ValidationError as e:
        raise _as_sample(malformed("gaze", e)) if sample else malformed("gaze", e) from e
    return GazeArrival(session, chunk, numbered)


class AoisMessage(NamedTuple):
    """AOIs that moved, for a session."""

    session: str | None
    positions: AoiPositions


def aois_of(text: str, source: str, now_s: float) -> AoisMessage:
    """Return AOIs that moved.

    Parameters
    ----------
    source
        The gaze source if the message names none.
    now_s
        The time of the bridge's clock, s. A message without ``t`` holds from then on, and one without ``seq`` gets the
        number of the millisecond: so the numbers rise, also after a restart of the bridge.
    """
    data = _object("aois", text)
    session = data.pop("session", None)
    if session is not None:
        _checked_id("session", session)
    found = {"source": source, "seq": round(now_s * 1000), "t": now_s} | {
        k: v for k, v in data.items() if v is not None
    }
    try:
        return AoisMessage(session, AoiPositions.model_validate(found))
    except ValidationError as e:
        raise malformed("aois", e) from e


def task_of(text: str) -> TaskMessage:
    """Return the message of ``/shift/task``."""
    return _validated("task", TaskMessage, text)


def performance_of(text: str) -> PerformanceMessage:
    """Return the message of ``/shift/task_performance``."""
    return _validated("task_performance", PerformanceMessage, text)


def text_of_fact(fact: Fact, payload: str) -> str:
    """Return a fact as its topic carries it: an observation as REST answers it (no AOI is null)."""
    if not isinstance(fact, Observation):
        return payload
    data = fact.model_dump(mode="json")
    data["gaze"]["aoi"] = data["gaze"]["aoi"] or None
    return text_of_answer(data)


def text_of_answer(answer: dict[str, Any]) -> str:
    """Return a command's result as the service's ``message``."""
    return to_json(answer).decode()


def text_of_error(error: ShiftError) -> str:
    """Return an error as the service's ``message``: kind, detail and errors."""
    return Problem.of(error).model_dump_json()


def _object(what: str, text: str) -> dict[str, Any]:
    if len(text) > TEXT_LIMIT:
        raise TooLarge(f"{what}: the message is above {TEXT_LIMIT // 1024} KB; send smaller chunks")
    data = parse_json(text)
    if not isinstance(data, dict):
        raise _refused(what, "data", data, "a JSON object")
    if "\\u" in text and not _is_encodable(data):
        raise _refused(what, "data", "", "text must be Unicode; a lone surrogate is not a character")
    return data


def _is_encodable(data: Any) -> bool:
    """Return whether the escaped characters can be encoded again."""
    try:
        json.dumps(data, ensure_ascii=False).encode()
    except UnicodeEncodeError:
        return False
    return True


def _validated(what: str, kind: type[M], text: str) -> M:
    _object(what, text)
    try:
        return kind.model_validate_json(text)
    except ValidationError as e:
        raise malformed(what, e) from e


def _checked_id(field: str, value: Any) -> None:
    try:
        _ID.validate_python(value, strict=True)
    except ValidationError as e:
        raise _refused("gaze", field, value, id_mistake(e.errors()[0]) or e.errors()[0]["msg"]) from e


def _refused(what: str, field: str, value: Any, rule: str) -> MalformedMessage:
    return MalformedMessage(f"{what}: {field}: {rule}", (FieldError(field=field, value=shorten(value), rule=rule),))


def _as_sample(error: MalformedMessage) -> MalformedMessage:
    """Return the error with fields that have no index, as a sample has none."""
    errors = tuple(e.model_copy(update={"field": e.field.removesuffix(".0")}) for e in error.errors)
    return MalformedMessage(f"gaze: {errors[0].field}: {errors[0].rule}", errors)
