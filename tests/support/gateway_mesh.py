"""A whole mesh in one process: four workers with their own journals, and the gateway, over the in-memory bus.

The HTTP client needs no network. HTTPX cannot read streams and WebSockets in this way, so for these the application is
called as a server would call it.
"""

from __future__ import annotations

import asyncio
import itertools
import json
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import httpx
from fastapi import FastAPI
from shift_decider.service import CORE as DECIDER
from shift_gateway.app import make_app
from shift_gateway.settings import GatewaySettings
from shift_learner.service import CORE as LEARNER
from shift_monitor.service import CORE as MONITOR
from shift_recorder.service import CORE as RECORDER
from shift_recorder.service import extend as extend_recorder
from shift_runtime.bus.memory import Hub, MemoryBus
from shift_runtime.bus.protocol import Bus
from shift_runtime.clock import ManualClock
from shift_runtime.journal import Journal
from shift_runtime.metrics import Metrics
from shift_runtime.service.core import Core
from shift_runtime.service.loop import Worker
from shift_runtime.settings import ServiceSettings

CORES: dict[str, Core[Any]] = {core.name: core for core in (RECORDER, MONITOR, DECIDER, LEARNER)}
START_NS = 1_700_000_000_000_000_000
HANG_LIMIT_S = 30.0
"""The time after which a test that hangs fails, seconds. No test asserts anything about it."""


@dataclass
class Service:
    """A running worker with its bus and journal."""

    worker: Worker[Any]
    task: asyncio.Task[None]
    bus: MemoryBus
    journal: Journal

    async def stop(self) -> None:
        """Stop the worker as a signal would."""
        self.worker.stop()
        await self.task
        await self.bus.close()
        self.journal.close()


@dataclass
class Mesh:
    """The running mesh, as a test uses it."""

    data: Path
    hub: Hub
    clock: ManualClock
    app: FastAPI
    http: httpx.AsyncClient
    services: dict[str, Service] = field(default_factory=dict)
    numbers: Any = field(default_factory=lambda: itertools.count(1))

    def start(self, name: str) -> None:
        """Start a service on its journal."""
        bus = MemoryBus(self.hub)
        journal = Journal(self.data / "state" / f"{name}.sqlite", name, CORES[name].lookups)
        extend = partial(extend_recorder, settings=ServiceSettings(data=self.data)) if name == "recorder" else None
        worker: Worker[Any] = Worker(CORES[name], bus, journal, self.clock, Metrics(name), extend)
        self.services[name] = Service(worker, asyncio.create_task(worker.run()), bus, journal)

    async def stop(self, name: str) -> None:
        """Stop a service and keep its journal."""
        await self.services.pop(name).stop()

    async def ask(self, method: str, path: str, body: Any = None, **given: Any) -> httpx.Response:
        """Send one request."""
        if body is not None:
            given["json"] = body
        return await self.http.request(method, path, **given)

    async def session(self, study: Any = "default", **given: Any) -> Session:
        """Begin a new session."""
        name = f"s{next(self.numbers)}"
        body = {"participant": "P01", "session": name, "study": study, "seed": 7, **given}
        answer = await self.ask("POST", "/v1/sessions", body)
        assert answer.status_code == 201, answer.text
        return Session(self, name)


@dataclass
class Session:
    """One session, as a REST client uses it."""

    mesh: Mesh
    name: str
    chunks: dict[str, int] = field(default_factory=dict)
    clock_s: float = 0.0

    def path(self, tail: str = "") -> str:
        """Return ``/v1/sessions/{name}/tail``."""
        return f"/v1/sessions/{self.name}" + (f"/{tail}" if tail else "")

    async def get(self, tail: str = "") -> Any:
        """Return the response to a read, whatever its status."""
        return await self.mesh.ask("GET", self.path(tail))

    async def read(self, tail: str = "") -> Any:
        """Return the answer to a read that succeeds."""
        answer = await self.get(tail)
        assert answer.status_code == 200, answer.text
        return answer.json()

    async def post(self, tail: str, body: Any = None) -> httpx.Response:
        """Return the response to a command, whatever its status."""
        return await self.mesh.ask("POST", self.path(tail), body)

    async def done(self, tail: str, body: Any = None) -> Any:
        """Return the answer to a command that succeeds."""
        answer = await self.post(tail, body)
        assert answer.status_code in (200, 201, 202), answer.text
        return answer.json()

    async def decide(self, task: str = "grasp", **given: Any) -> Any:
        """Make a decision."""
        return await self.done("decisions", {"task": task, **given})

    async def report(self, decision_id: str, understood: bool = True, able: bool = True, seconds: float = 5.0) -> Any:
        """Report a performance."""
        return await self.done("performance", performance(decision_id, understood, able, seconds))

    async def look(self, aois: list[str | None], step_s: float = 0.5, source: str = "ros") -> Any:
        """Send a chunk of AOI names, ``step_s`` apart."""
        t = [self.clock_s + i * step_s for i in range(len(aois))]
        self.clock_s = t[-1] + step_s
        seq = self.chunks.get(source, 0)
        self.chunks[source] = seq + 1
        return await self.done("gaze", {"source": source, "seq": seq, "t": t, "aoi": aois})

    async def configure(self, patch: Any) -> httpx.Response:
        """Patch the configuration."""
        return await self.mesh.ask("PATCH", self.path("config"), patch)

    async def end(self) -> Any:
        """End the session."""
        return await self.done("end")


def performance(decision_id: str, understood: bool = True, able: bool = True, seconds: float = 5.0) -> dict[str, Any]:
    """Return the body of a report."""
    return {
        "decision_id": decision_id,
        "comprehension": {"success": understood, "duration_s": seconds},
        "enabledness": {"success": able, "duration_s": seconds},
    }


@asynccontextmanager
async def running_mesh(data: Path, patience_s: float = 1.0) -> AsyncIterator[Mesh]:
    """Run the mesh until the context is left."""
    hub, clock = Hub(), ManualClock(START_NS)

    async def open_buses() -> list[Bus]:
        return [MemoryBus(hub)]

    app = make_app(GatewaySettings(data=data, patience_s=patience_s), open_buses, clock)
    async with AsyncExitStack() as stack:
        http = httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://127.0.0.1", timeout=None)
        mesh = Mesh(data, hub, clock, app, await stack.enter_async_context(http))
        for name in CORES:
            mesh.start(name)
        stack.push_async_callback(_stop_all, mesh)
        await stack.enter_async_context(app.router.lifespan_context(app))
        await until_ready(mesh)
        yield mesh


async def _stop_all(mesh: Mesh) -> None:
    await asyncio.gather(*(mesh.stop(name) for name in list(mesh.services)))


async def until_ready(mesh: Mesh) -> None:
    """Wait until ``/readyz`` is true."""
    async with asyncio.timeout(HANG_LIMIT_S):
        while (await mesh.ask("GET", "/readyz")).status_code != 200:  # noqa: ASYNC110 - readiness has no event
            await asyncio.sleep(0.005)


# --- streams and WebSockets ---


@dataclass
class Call:
    """A call of the application for one connection."""

    scope: dict[str, Any]
    incoming: asyncio.Queue[dict[str, Any]] = field(default_factory=asyncio.Queue)
    outgoing: asyncio.Queue[dict[str, Any]] = field(default_factory=asyncio.Queue)

    async def next(self) -> dict[str, Any]:
        """Return the next message that the application sends."""
        return await asyncio.wait_for(self.outgoing.get(), HANG_LIMIT_S)


@asynccontextmanager
async def called(mesh: Mesh, kind: str, path: str) -> AsyncIterator[Call]:
    """Open a connection. The client closes it when the context is left."""
    scope = {
        "type": kind, "path": path, "raw_path": path.encode(), "query_string": b"", "headers": [], "method": "GET",
        "scheme": "ws" if kind == "websocket" else "http", "http_version": "1.1", "root_path": "",
        "asgi": {"version": "3.0", "spec_version": "2.3"}, "client": ("test", 1), "server": ("mesh", 80),
        "subprotocols": [],
    }  # fmt: skip
    call = Call(scope)
    task = asyncio.create_task(mesh.app(scope, call.incoming.get, call.outgoing.put))
    try:
        yield call
    finally:
        await call.incoming.put({"type": "http.disconnect" if kind == "http" else "websocket.disconnect", "code": 1000})
        await asyncio.wait_for(task, HANG_LIMIT_S)


@asynccontextmanager
async def events_of(session: Session) -> AsyncIterator[AsyncIterator[tuple[str, Any]]]:
    """Yield the session's server-sent events, as (event, data)."""
    async with called(session.mesh, "http", session.path("events")) as call:
        await call.incoming.put({"type": "http.request", "body": b"", "more_body": False})
        start = await call.next()
        assert start["status"] == 200
        headers = dict(start["headers"])
        assert headers[b"content-type"].startswith(b"text/event-stream")
        assert (await call.next())["body"].startswith(b":"), "a comment opens the stream"

        async def events() -> AsyncIterator[tuple[str, Any]]:
            while True:
                lines = (await call.next())["body"].decode().splitlines()
                if lines and lines[0].startswith("event: "):
                    assert lines[1].startswith("data: ")
                    yield lines[0].removeprefix("event: "), json.loads(lines[1].removeprefix("data: "))

        yield events()


@dataclass
class Socket:
    """A WebSocket's client side."""

    call: Call

    async def send(self, message: Any) -> Any:
        """Send a message (bytes, text or an object as JSON). Return the answer."""
        if isinstance(message, bytes):
            await self.call.incoming.put({"type": "websocket.receive", "bytes": message})
        else:
            text = message if isinstance(message, str) else json.dumps(message)
            await self.call.incoming.put({"type": "websocket.receive", "text": text})
        answer = await self.call.next()
        assert answer["type"] == "websocket.send", answer
        return json.loads(answer["text"])


@asynccontextmanager
async def gaze_socket(mesh: Mesh, session: str) -> AsyncIterator[Socket]:
    """Open a WebSocket for the session's gaze."""
    async with called(mesh, "websocket", f"/v1/sessions/{session}/gaze") as call:
        await call.incoming.put({"type": "websocket.connect"})
        assert (await call.next())["type"] == "websocket.accept"
        yield Socket(call)


STUDY: dict[str, Any] = {
    "study": "mine",
    "tasks": ["grasp", "turn"],
    "aois": [{"name": "robot", "rectangle": [0, 0, 0.5, 1]}, {"name": "cup", "rectangle": [0.5, 0, 1, 1]}],
    "conditions": {"control": {"learner": {"name": "scoring"}}, "adaptive": {}},
}

PLAIN, NEGATED = {"negation": "affirmation", "hesitation": "none"}, {"negation": "negation", "hesitation": "none"}


def problem(answer: httpx.Response, status: int) -> dict[str, Any]:
    """Return the problem document of an answer, after checking its shape."""
    assert answer.status_code == status, answer.text[:500]
    assert answer.headers["content-type"] == "application/problem+json"
    found: dict[str, Any] = answer.json()
    assert found.keys() == {"type", "title", "status", "detail", "errors"}
    assert found["status"] == status
    assert all(isinstance(found[name], str) and found[name] for name in ("type", "title", "detail"))
    for error in found["errors"]:
        assert error.keys() == {"field", "value", "rule"}
        assert len(error["field"]) <= 80
        assert len(error["value"]) <= 80
    assert len(answer.content) < 16_000, "no echo of long input"
    return found
