"""The event stream: server-sent events with the facts of a session."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from shift_gateway import event_stream
from shift_gateway.event_stream import EVENTS_WAITING, encoded_events, listening
from shift_runtime.metrics import Metrics
from shift_runtime.read_model import SessionView
from shift_schemas.messages import Marker, Session
from shift_schemas.timestamps import Stamp
from support.gateway_mesh import Mesh, called, events_of

pytestmark = pytest.mark.anyio
NOW = Stamp.of(0)
MARKER = Marker(session="s1", stamp=NOW, marker_id="m1", text="a note")


def view_of_a_session() -> SessionView:
    return SessionView(Session(session="s1", stamp=NOW, participant="P", study="x", seed=1, state="live", started=NOW))


async def test_event_stream_has_the_facts_of_the_session(mesh: Mesh) -> None:
    session, other = await mesh.session(), await mesh.session()
    async with events_of(session) as events:
        await other.decide()
        decision = await session.decide(decision_id="d1")
        await session.report("d1")
        seen: dict[str, Any] = {}
        async for name, data in events:
            assert data["session"] == session.name
            seen.setdefault(name, data)
            if {"decision", "performance", "transition", "policy", "observation"} <= seen.keys():
                break
    assert seen["decision"]["decision_id"] == "d1"
    assert seen["decision"]["strategy"] == decision["strategy"]


async def test_event_stream_of_an_unknown_session_is_404(mesh: Mesh) -> None:
    assert (await mesh.ask("GET", "/v1/sessions/nobody/events")).status_code == 404


async def test_event_is_the_subject_and_the_fact_as_it_was_published(mesh: Mesh) -> None:
    session = await mesh.session()
    async with called(mesh, "http", session.path("events")) as call:
        await call.incoming.put({"type": "http.request", "body": b"", "more_body": False})
        start = await call.next()
        assert dict(start["headers"])[b"cache-control"] == b"no-cache"
        assert (await call.next())["body"] == b": shift-mesh\n\n"
        await session.done("markers", {"text": "one\ntwo", "marker_id": "m1"})
        event = ""
        while event != "event: marker":  # what began with the session may still come before it
            event, data, *rest = (await call.next())["body"].decode().split("\n")
    assert rest == ["", ""]
    assert Marker.model_validate_json(data.removeprefix("data: ")).text == "one\ntwo"


async def test_closed_stream_no_longer_listens(mesh: Mesh, monkeypatch: pytest.MonkeyPatch) -> None:
    views: list[SessionView] = []
    monkeypatch.setattr(event_stream, "listening", lambda view, metrics: views.append(view) or listening(view, metrics))
    session = await mesh.session()
    async with events_of(session):
        assert len(views[0].listeners) == 1
    async with asyncio.timeout(30.0):
        while views[0].listeners:  # noqa: ASYNC110 - the end of a stream has no event
            await asyncio.sleep(0.005)


async def test_stream_of_a_slow_client_is_counted_and_ends() -> None:
    view, metrics = view_of_a_session(), Metrics("gateway")
    with listening(view, metrics) as waiting:
        (listen,) = view.listeners
        for _ in range(EVENTS_WAITING):
            listen(MARKER, "{}")
        assert view.listeners, "a full queue still listens"
        listen(MARKER, "{}")
        assert not view.listeners
        events = [waiting.get_nowait() for _ in range(waiting.qsize())]
    assert (len(events), events[0], events[-1]) == (EVENTS_WAITING, ("marker", "{}"), None)
    assert b'shift_messages_dropped_total{reason="overload",service="gateway"} 1.0' in metrics.text()


async def test_silent_stream_is_kept_alive_by_comments(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(event_stream, "KEEP_ALIVE_S", 0.01)
    view = view_of_a_session()
    stream = encoded_events(view, Metrics("gateway"))
    assert [await anext(stream) for _ in range(3)] == [b": shift-mesh\n\n", b": ping\n\n", b": ping\n\n"]
    view.listeners[0](MARKER, "{}")
    assert await anext(stream) == b"event: marker\ndata: {}\n\n"
    await stream.aclose()  # type: ignore[attr-defined]
    assert not view.listeners
