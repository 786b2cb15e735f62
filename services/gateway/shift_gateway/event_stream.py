"""``GET /v1/sessions/{session}/events``: the facts of a session as server-sent events, as they happen."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Iterator
from contextlib import contextmanager

from fastapi import Depends, FastAPI, Request
from fastapi.sse import EventSourceResponse, ServerSentEvent
from shift_runtime.metrics import Metrics
from shift_runtime.read_model import SessionView
from shift_schemas.errors import check_id
from shift_schemas.messages import Fact

from shift_gateway.gateway import Gateway

EVENTS_WAITING = 2_000
"""How many events may wait for a slow client. Above that its stream ends, and the client can connect again."""

Events = asyncio.Queue[tuple[str, str] | None]
"""Subject and payload of each fact; None ends the stream."""


def add_events(app: FastAPI, gateway: Gateway) -> None:
    """Add the path. FastAPI sends a comment every 15 s to keep the connection alive."""

    async def known_session(session: str) -> SessionView:
        """Return the session's view before the stream begins: an unknown session is a problem and not a stream."""
        return await gateway.read_model.view(check_id("session", session))

    @app.get("/v1/sessions/{session}/events", tags=["reading"], response_class=EventSourceResponse)
    async def events(
        request: Request,
        view: SessionView = Depends(known_session),  # noqa: B008 - this is how FastAPI declares it
    ) -> AsyncIterator[ServerSentEvent]:
        """Stream server-sent events: event = subject, data = the message."""
        if request.method == "HEAD":
            return
        with listening(view, gateway.metrics) as waiting:
            yield ServerSentEvent(comment="shift-mesh")
            while (event := await waiting.get()) is not None:
                yield ServerSentEvent(event=event[0], raw_data=event[1])


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
