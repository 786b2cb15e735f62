"""Errors as ``application/problem+json`` (RFC 9457), and bodies read strictly."""

from __future__ import annotations

from http import HTTPStatus
from typing import Any, TypeVar

from fastapi import Request
from fastapi.responses import JSONResponse
from pydantic import BaseModel, ValidationError
from shift_schemas.errors import FieldError, MalformedMessage, Problem, ShiftError, TooLarge, malformed, shorten
from shift_schemas.ids import ID_RULE, is_id
from shift_schemas.strict_json import parse_json
from starlette.types import ASGIApp, Message, Receive, Scope, Send

BODY_LIMIT = 256 * 1024
M = TypeVar("M", bound=BaseModel)
MEDIA_TYPE = "application/problem+json"


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


def check_id(name: str, value: str) -> str:
    """``value``, or :class:`MalformedMessage` that says what an id is."""
    if not is_id(value):
        error = FieldError(field=name, value=shorten(value), rule=ID_RULE)
        raise MalformedMessage(f"{name}: {ID_RULE}", (error,))
    return value


async def json_body(request: Request) -> Any:
    """The body as JSON. Raises :class:`MalformedMessage`, also for a key given twice."""
    return parse_json(await request.body())


async def body(request: Request, kind: type[M]) -> M:
    """The body as a message. Raises :class:`MalformedMessage` that names field, value and rule."""
    return message(await request.body(), kind)


def message(raw: bytes | str, kind: type[M]) -> M:
    """``raw`` as a message. Raises :class:`MalformedMessage`."""
    parse_json(raw)
    try:
        return kind.model_validate_json(raw)
    except ValidationError as e:
        raise malformed("body", e) from e


class BodyLimit:
    """ASGI middleware: refuses bodies above the limit, also those that come in pieces without a length."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Count what is received."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        length = dict(scope["headers"]).get(b"content-length", b"")
        if length.isdigit() and int(length) > BODY_LIMIT:
            await _too_large(scope, receive, send)
            return
        total, refused, started = 0, False, False

        async def counted() -> Message:
            nonlocal total, refused
            piece = await receive()
            total += len(piece.get("body", b""))
            if total > BODY_LIMIT:
                refused = True
                return {"type": "http.request", "body": b"", "more_body": False}
            return piece

        async def unless_refused(piece: Message) -> None:
            nonlocal started
            if refused and not started:
                return
            started = True
            await send(piece)

        await self.app(scope, counted, unless_refused)
        if refused and not started:
            await _too_large(scope, receive, send)


async def _too_large(scope: Scope, receive: Receive, send: Send) -> None:
    error = TooLarge(f"the body is above {BODY_LIMIT // 1024} KB; send gaze in smaller chunks")
    await problem_response(error)(scope, receive, send)
