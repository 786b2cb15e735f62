"""The paths of the commands, derived from the commands themselves: a new command with a route has its path.

A request is checked in the order ids, session, body.
"""

from __future__ import annotations

import inspect
from collections.abc import Awaitable, Callable, Iterable

from fastapi import FastAPI, Request, Response
from fastapi.responses import JSONResponse
from shift_schemas.errors import check_id
from shift_schemas.messages import Command, StartSession
from shift_schemas.registry import COMMANDS
from shift_schemas.requests import body_type

from shift_gateway.gateway import Gateway
from shift_gateway.openapi import documented_body, documented_query
from shift_gateway.problems import only, read_body


def add_commands(app: FastAPI, gateway: Gateway, commands: Iterable[type[Command]] = tuple(COMMANDS.values())) -> None:
    """Add the path of each command that has a route."""
    for kind in commands:
        if kind.route is None:
            continue
        handler = _start(gateway) if kind is StartSession else _command(gateway, kind)
        has_body = bool(kind.route.media_types)
        app.add_api_route(
            kind.route.path, handler, methods=[kind.route.method], status_code=kind.route.status, tags=[kind.route.tag],
            name=kind.route.name or kind.procedure, description=inspect.getdoc(kind),
            openapi_extra=documented_query(kind)
            | (documented_body(body_type(kind), kind.route.media_types) if has_body else {}),
        )  # fmt: skip


def _start(gateway: Gateway) -> Callable[[Request], Awaitable[Response]]:
    """Return the handler of a start, the only command of a session that does not exist yet."""
    status = StartSession.route.status

    async def start(request: Request) -> Response:
        content, repeat = await gateway.api.start(await read_body(request, body_type(StartSession)))
        return JSONResponse(content, 200 if repeat else status)

    return start


def _command(gateway: Gateway, kind: type[Command]) -> Callable[[str, Request], Awaitable[Response]]:
    """Return the handler of a command in a session."""
    assert kind.route is not None
    status, has_body = kind.route.status, bool(kind.route.media_types)

    async def command(session: str, request: Request) -> Response:
        await gateway.read_model.view(check_id("session", session))
        if has_body:
            body = await read_body(request, body_type(kind))
        else:
            await request.body()  # it is ignored, but not above the limit
            body = None
        given = request.query_params
        further = {name: only(name, given.getlist(name)) for name in kind.query_fields if name in given}
        content, repeat = await gateway.api.command(kind, session, body, **further)
        return JSONResponse(content, 200 if repeat else status)

    return command
