"""The payloads of messages: JSON by pydantic, with an encoding that names the message and its version. Pure."""

from __future__ import annotations

from typing import TypeVar

from pydantic import BaseModel, ValidationError

from shift_schemas.errors import MalformedMessage, malformed
from shift_schemas.messages import Answer

M = TypeVar("M", bound=BaseModel)
VERSION = "v1"


def encoding_of(message: type[BaseModel]) -> str:
    """Return the encoding of a message, such as ``application/json;shift.Decision.v1``."""
    return f"application/json;shift.{message.__name__}.{VERSION}"


def encode(message: BaseModel) -> bytes:
    """Return the message as JSON."""
    return message.model_dump_json().encode()


def encode_answer(owner: str, seq: int, repeat: bool, result: str) -> bytes:
    """Return an :class:`Answer` with a ``result`` that is JSON already."""
    envelope = Answer(owner=owner, seq=seq, repeat=repeat, result={}).model_dump_json()
    return f"{envelope.removesuffix('{}}')}{result}}}".encode()


def decode(kind: type[M], payload: bytes | str) -> M:
    """Return the message in ``payload``. Raise :class:`MalformedMessage`, which says what is wrong with it."""
    try:
        return kind.model_validate_json(payload)
    except ValidationError as e:
        raise malformed(kind.__name__, e) from e
    except (RecursionError, UnicodeError, ValueError) as e:
        raise MalformedMessage(f"{kind.__name__}: not readable as JSON") from e
