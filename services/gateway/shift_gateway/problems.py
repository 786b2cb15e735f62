"""Errors as ``application/problem+json`` (RFC 9457), and bodies read strictly."""

from __future__ import annotations

from collections.abc import Iterable
from http import HTTPStatus
from typing import Any, TypeVar

from fastapi import Request
from fastapi.responses import JSONResponse
from pydantic import BaseModel, ValidationError
from shift_schemas.errors import FieldError, MalformedMessage, Problem, ShiftError, TooLarge, malformed, shorten
from shift_schemas.strict_json import NotJson, parse_json
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from shift_gateway.request_bodies import check_encoding, not_an_object, not_json, without_mark

BODY_LIMIT = 256 * 1024
M = TypeVar("M", bound=BaseModel)
MEDIA_TYPE = "application/problem+json"


_TEXT = {"type": "string"}
PROBLEM_RESPONSE: dict[str, Any] = {
    "description": "A problem (RFC 9457)",
    "content": {
        MEDIA_TYPE: {
            "schema": {
                "type": "object",
                "required": ["type", "title", "status", "detail", "errors"],
                "properties": {
                    "type": _TEXT,
                    "title": _TEXT,
                    "status": {"type": "integer"},
                    "detail": _TEXT,
                    "errors": {"type": "array", "items": FieldError.model_json_schema()},
                },
            }
        }
    },
}
"""What every path of the OpenAPI document answers where it does not do what it is asked."""


def problem_body(error: ShiftError) -> dict[str, Any]:
    """The problem document of an error."""
    return {
        "type": f"urn:shift:problem:{error.kind}",
        "title": error.title,
        "status": error.status,
        "detail": error.detail,
        "errors": [e.model_dump() for e in Problem.of(error).errors],
    }


def problem_response(error: ShiftError) -> JSONResponse:
    """The response of an error."""
    headers = {"Retry-After": "1"} if error.status == HTTPStatus.SERVICE_UNAVAILABLE else None
    return JSONResponse(problem_body(error), error.status, headers=headers, media_type=MEDIA_TYPE)


def only(name: str, values: list[str]) -> str:
    """Return the one value of a query parameter. Raise :class:`MalformedMessage` where it is missing or repeated."""
    if len(values) == 1:
        return values[0]
    rule = f"it is given {len(values)} times; give it once"
    if not values:
        rule = f"it is missing; write it into the address, as in ...?{name}=grasp, since the body of a GET is not read"
    raise MalformedMessage(f"{name}: {rule}", (FieldError(field=name, value=shorten(", ".join(values)), rule=rule),))


def check_size(size: int) -> None:
    """Raise :class:`TooLarge` where a body or a WebSocket's message is above the limit, in bytes."""
    if size > BODY_LIMIT:
        raise TooLarge(f"the body is above {BODY_LIMIT // 1024} KB; send gaze in smaller chunks")


async def read_body(request: Request, kind: type[M]) -> M:
    """Return the body as a message. Raise :class:`MalformedMessage`, which names field, value and rule."""
    check_encoding(request.headers.get("content-encoding", ""))
    return parse_body(await request.body(), kind, request.query_params.multi_items())


def parse_body(raw: bytes | str, kind: type[M], query: Iterable[tuple[str, str]] = ()) -> M:
    """Return ``raw`` as a message. Raise :class:`MalformedMessage`; ``query`` helps to explain an empty body."""
    raw = without_mark(raw)
    try:
        data = parse_json(raw if isinstance(raw, str) else raw.decode())
    except (NotJson, UnicodeDecodeError) as e:
        raise not_json(raw, query) from e
    if not isinstance(data, dict):
        raise not_an_object(data)
    try:
        return kind.model_validate_json(raw)
    except ValidationError as e:
        raise malformed("body", e) from e


class BodyLimit:
    """ASGI middleware: a body above the limit is refused when it is read, also one in pieces without a length.

    Raised from ``receive``, so that nothing is done with a part of it, and ids and session are looked at before.
    """

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Count what is received."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        length = dict(scope["headers"]).get(b"content-length", b"")
        announced, received = int(length[:20]) if length.isdigit() else 0, 0

        async def counted() -> Message:
            nonlocal received
            check_size(announced)
            piece = await receive()
            received += len(piece.get("body", b""))
            check_size(received)
            return piece

        await self.app(scope, counted, send)
