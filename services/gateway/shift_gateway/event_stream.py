"""``GET /v1/sessions/{session}/events``: the facts of a session as server-sent events, as they happen.

The encoding is FastAPI's. The stream itself is ours: in FastAPI 0.165 a path that yields events fails with an unhandled
``BrokenResourceError`` when a client disconnects while an event is on its way.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Iterator
from contextlib import contextmanager

from fastapi import FastAPI, Request, Response
from fastapi.responses import StreamingResponse
from fastapi.sse import KEEPALIVE_COMMENT, EventSourceResponse, format_sse_event
from shift_runtime.metrics import Metrics
from shift_runtime.read_model import SessionView
from shift_schemas.errors import check_id
from shift_schemas.messages import Fact

from shift_gateway.gateway import Gateway

EVENTS_WAITING = 2_000
"""How many events may wait for a slow client. Above that its stream ends, and the client can connect again."""

KEEP_ALIVE_S = 15.0
"""How long a stream may be silent, seconds. Then a comment keeps the connection open."""

Events = asyncio.Queue[tuple[str, str] | None]
"""Subject and payload of each fact; None ends the stream."""


def add_events(app: FastAPI, gateway: Gateway) -> None:
    """Add the path."""

    @app.get("/v1/sessions/{session}/events", tags=["reading"], response_class=StreamingResponse)
    async def events(session: str, request: Request) -> Response:
        """Stream server-sent events: event = subject, data = the message."""
        view = await gateway.read_model.view(check_id("session", session))
        headers = {"Cache-Control": "no-cache"}
        if request.method == "HEAD":
            return Response(media_type=EventSourceResponse.media_type, headers=headers)
        return EventSourceResponse(encoded_events(view, gateway.metrics), headers=headers)


async def encoded_events(view: SessionView, metrics: Metrics) -> AsyncIterator[bytes]:
    """Yield the session's facts as server-sent events, until the client is too slow or disconnects."""
    with listening(view, metrics) as waiting:
        yield format_sse_event(comment="shift-mesh")
        while True:
            try:
                async with asyncio.timeout(KEEP_ALIVE_S):
                    event = await waiting.get()
            except TimeoutError:
                yield KEEPALIVE_COMMENT
                continue
            if event is None:
                return
            yield format_sse_event(event=event[0], data_str=event[1])


@contextmanager
def listening(view: SessionView, metrics: Metrics) -> Iterator[Events]:
    """Queue the session's facts until the context is left. A full queue is counted and ends the stream."""
    waiting: Events = asyncio.Queue(EVENTS_WAITING)

    def listen(fact: Fact, payload: str) -> None:
        if waiting.full():
            view.listeners.remove(listen)
            metrics.dropped("overload")
            waiting.get_nowait()
            waiting.put_nowait(None)
        else:
            waiting.put_nowait((fact.subject, payload))

    view.listeners.append(listen)
    try:
        yield waiting
    finally:
        if listen in view.listeners:
            view.listeners.remove(listen)
