"""The REST paths (INTERFACE.md, "REST"): HTTP around the door, in the order ids, session, body."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Annotated, Any

from fastapi import FastAPI, Query, Request, Response, WebSocket, WebSocketDisconnect
from fastapi.responses import FileResponse, HTMLResponse, JSONResponse, StreamingResponse
from pydantic import BaseModel
from shift_runtime.bus.protocol import Bus
from shift_runtime.clock import Clock
from shift_runtime.mesh_client import MeshClient
from shift_runtime.metrics import Metrics
from shift_schemas.codec import encode
from shift_schemas.errors import ShiftError, UnknownThing, check_id
from shift_schemas.keys import ServiceKey, build_key
from shift_schemas.messages import Fact, GazeChunk, Health
from shift_schemas.registry import OWNERS

from shift_gateway import bodies
from shift_gateway.docs_page import add_docs
from shift_gateway.gateway_api import GatewayApi
from shift_gateway.merged_metrics import gathered
from shift_gateway.origins import Rules
from shift_gateway.page import PAGE, PAGE_POLICY
from shift_gateway.paths import GatewayApp
from shift_gateway.problems import (
    PROBLEM_RESPONSE,
    BodyLimit,
    body,
    check_size,
    message,
    only,
    problem_body,
    problem_response,
)
from shift_gateway.readiness import readiness
from shift_gateway.recordings import list_recordings, recording_path
from shift_gateway.session_views import ReadModel
from shift_gateway.settings import GatewaySettings
from shift_gateway.studies import add_studies

SERVICES = tuple(OWNERS)
EVENTS_WAITING = 2_000
"""Events that a slow listener may have waiting; then its stream is closed, and it can come again."""
KEEP_ALIVE_S = 15.0

Opener = Callable[[], Awaitable[Bus]]


class Gateway:
    """What the paths share while the application is up."""

    api: GatewayApi
    read_model: ReadModel
    mesh: MeshClient

    def __init__(self, settings: GatewaySettings) -> None:
        self.settings = settings
        self.metrics = Metrics("gateway")

    @property
    def recordings(self) -> Path:
        """Where the finished recordings are."""
        return self.settings.data / "recordings"

    @asynccontextmanager
    async def on(self, bus: Bus, clock: Clock) -> AsyncIterator[None]:
        """Open the replica and the door on a bus, until left."""
        self.mesh = MeshClient(bus, self.settings.patience_s)
        self.read_model = ReadModel(bus, self.metrics.dropped, self.metrics.link_lost)
        self.api = GatewayApi(self.mesh, self.read_model, clock)
        bus.serve(build_key(ServiceKey("gateway", "health")), lambda r: r.reply(encode(self.health())))
        bus.serve(build_key(ServiceKey("gateway", "metrics")), lambda r: r.reply(self.metrics_text()))
        bus.token(build_key(ServiceKey("gateway", "alive")))
        self.read_model.reader.start()
        pulling = asyncio.create_task(self.read_model.reader.run())
        try:
            yield
        finally:
            pulling.cancel()
            await bus.close()

    def metrics_text(self) -> bytes:
        """The gateway's own metrics."""
        for owner in OWNERS:
            self.metrics.silent(owner, self.read_model.reader.links.silent_s(owner))
        return self.metrics.text()

    def health(self) -> Health:
        """The gateway's own."""
        missing = self.read_model.missing
        unreached = self.read_model.reader.links.unreached
        detail = f"waits for the {', the '.join(missing)}" if missing else ""
        if not detail and unreached:
            detail = f"the gateway does not reach the {', the '.join(unreached)}"
        return Health(
            service="gateway", ready=not detail, detail=detail, sessions=len(self.read_model.views), unreached=unreached
        )


def make_app(settings: GatewaySettings, open_bus: Opener, clock: Clock) -> FastAPI:
    """The application. ``open_bus`` is called when it starts, in its loop."""
    gateway = Gateway(settings)

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        async with gateway.on(await open_bus(), clock):
            yield

    app = GatewayApp(
        Rules(settings.host, settings.hosts, settings.origins),
        title="SHIFT mesh",
        summary="How should the robot phrase its next explanation for this person, now?",
        version="v1",
        lifespan=lifespan,
        license_info={"name": "MIT"},
        responses={"default": PROBLEM_RESPONSE},
    )
    app.add_middleware(BodyLimit)
    app.add_exception_handler(ShiftError, _on_shift_error)
    _add_sessions(app, gateway)
    _add_interaction(app, gateway)
    _add_reads(app, gateway)
    _add_recordings(app, gateway)
    add_studies(app, settings.data / "studies")
    _add_operations(app, gateway)
    add_docs(app)
    return app


async def _on_shift_error(request: Request, error: Exception) -> Response:
    assert isinstance(error, ShiftError)
    return problem_response(error)


def _documented(kind: type[BaseModel]) -> dict[str, Any]:
    """The body in the OpenAPI document; it is read by hand, after ids and session."""
    schema = kind.model_json_schema(ref_template="#/components/schemas/{model}")
    definitions = schema.pop("$defs", {})
    return {
        "requestBody": {"required": True, "content": {"application/json": {"schema": _inlined(schema, definitions)}}}
    }


def _inlined(node: Any, definitions: dict[str, Any]) -> Any:
    if isinstance(node, dict):
        if "$ref" in node:
            return _inlined(definitions[node["$ref"].rsplit("/", 1)[1]], definitions)
        return {k: _inlined(v, definitions) for k, v in node.items()}
    if isinstance(node, list):
        return [_inlined(v, definitions) for v in node]
    return node


def _created(answer: tuple[dict[str, Any], bool]) -> JSONResponse:
    content, repeat = answer
    return JSONResponse(content, 200 if repeat else 201)


def _add_sessions(app: FastAPI, gateway: Gateway) -> None:
    @app.post("/v1/sessions", status_code=201, tags=["sessions"], openapi_extra=_documented(bodies.StartBody))
    async def start_session(request: Request) -> Response:
        """Begin a session. The same start again gets the first result."""
        return _created(await gateway.api.start(await body(request, bodies.StartBody)))

    @app.get("/v1/sessions", tags=["sessions"])
    async def list_sessions() -> dict[str, Any]:
        """Every session."""
        return {"sessions": await gateway.api.sessions()}

    @app.get("/v1/sessions/{session}", tags=["sessions"])
    async def get_session(session: str) -> dict[str, Any]:
        """One session, with counts so far."""
        return await gateway.api.session(check_id("session", session))

    @app.post("/v1/sessions/{session}/end", tags=["sessions"])
    async def end_session(session: str, request: Request) -> dict[str, Any]:
        """End a session; answered once its recording is finished. It needs no body and takes no notice of one."""
        await gateway.read_model.view(check_id("session", session))
        await request.body()
        return await gateway.api.end(session)

    @app.get("/v1/sessions/{session}/config", tags=["configuration"])
    async def get_config(session: str) -> dict[str, Any]:
        """The study in force."""
        return await gateway.api.config(check_id("session", session))

    @app.patch("/v1/sessions/{session}/config", tags=["configuration"], openapi_extra=_PATCH)
    async def patch_config(session: str, request: Request) -> dict[str, Any]:
        """Change the study in force by a JSON merge patch (RFC 7386)."""
        await gateway.read_model.view(check_id("session", session))
        return await gateway.api.configure(session, (await body(request, bodies.PatchBody)).root)


_PATCH = {
    "requestBody": {
        "required": True,
        "content": {t: {"schema": {"type": "object"}} for t in ("application/merge-patch+json", "application/json")},
    }
}


def _add_interaction(app: FastAPI, gateway: Gateway) -> None:
    @app.post(
        "/v1/sessions/{session}/gaze", status_code=202, tags=["interaction"], openapi_extra=_documented(GazeChunk)
    )
    async def post_gaze(session: str, request: Request) -> dict[str, Any]:
        """A chunk of gaze, points or AOI names."""
        await gateway.read_model.view(check_id("session", session))
        return await gateway.api.gaze(session, await body(request, GazeChunk))

    @app.websocket("/v1/sessions/{session}/gaze")
    async def stream_gaze(socket: WebSocket, session: str) -> None:
        await socket.accept()
        try:
            while True:
                arrived = await socket.receive()
                if arrived["type"] == "websocket.disconnect":
                    return
                raw = arrived.get("text") or arrived.get("bytes") or ""
                await socket.send_json(await _take_chunk(gateway, session, raw))
        except WebSocketDisconnect:
            return

    @app.post(
        "/v1/sessions/{session}/decisions",
        status_code=201,
        tags=["interaction"],
        openapi_extra=_documented(bodies.DecisionBody),
    )
    async def decide(session: str, request: Request) -> Response:
        """The strategy to use now, and why."""
        await gateway.read_model.view(check_id("session", session))
        asked = await body(request, bodies.DecisionBody)
        return _created(await gateway.api.decide(session, asked.task, asked.decision_id))

    @app.post(
        "/v1/sessions/{session}/performance",
        status_code=201,
        tags=["interaction"],
        openapi_extra=_documented(bodies.PerformanceBody),
    )
    async def report_performance(session: str, request: Request) -> Response:
        """How the task went."""
        await gateway.read_model.view(check_id("session", session))
        return _created(await gateway.api.report(session, await body(request, bodies.PerformanceBody)))

    @app.post(
        "/v1/sessions/{session}/override",
        status_code=201,
        tags=["interaction"],
        openapi_extra=_documented(bodies.OverrideBody),
    )
    async def override(session: str, request: Request) -> Response:
        """Choose the strategy of the task's next decision."""
        await gateway.read_model.view(check_id("session", session))
        return _created(await gateway.api.override(session, await body(request, bodies.OverrideBody)))

    @app.post(
        "/v1/sessions/{session}/markers",
        status_code=201,
        tags=["interaction"],
        openapi_extra=_documented(bodies.MarkerBody),
    )
    async def mark(session: str, request: Request) -> Response:
        """Note something in the recording."""
        await gateway.read_model.view(check_id("session", session))
        return _created(await gateway.api.mark(session, await body(request, bodies.MarkerBody)))


async def _take_chunk(gateway: Gateway, session: str, raw: str | bytes) -> dict[str, Any]:
    try:
        check_id("session", session)
        await gateway.read_model.view(session)
        check_size(len(raw))
        chunk = message(raw, GazeChunk)
        return {**await gateway.api.gaze(session, chunk), "seq": chunk.seq}
    except ShiftError as e:
        return problem_body(e)


def _add_reads(app: FastAPI, gateway: Gateway) -> None:
    @app.get("/v1/sessions/{session}/observation", tags=["reading"])
    async def get_observation(session: str) -> dict[str, Any]:
        """The partner model."""
        return await gateway.api.observation(check_id("session", session))

    @app.get("/v1/sessions/{session}/policy", tags=["reading"])
    async def get_policy(session: str) -> dict[str, Any]:
        """The policy for the next decision."""
        return await gateway.api.policy(check_id("session", session))

    @app.get("/v1/sessions/{session}/strategy", tags=["reading"])
    async def preview(
        session: str,
        task: Annotated[list[str], Query(description="The task.")] = [],  # noqa: B006 - FastAPI copies it
    ) -> dict[str, Any]:
        """What a decision made now would carry; no side effect."""
        check_id("session", session)
        return await gateway.api.preview(session, check_id("task", only("task", task)))

    @app.get("/v1/sessions/{session}/events", tags=["reading"], response_class=StreamingResponse)
    async def events(session: str, request: Request) -> Response:
        """Server-sent events: event = subject, data = the message."""
        view = await gateway.read_model.view(check_id("session", session))
        waiting: asyncio.Queue[str | None] = asyncio.Queue(EVENTS_WAITING)

        def listen(fact: Fact, payload: str) -> None:
            if waiting.full():
                view.listeners.remove(listen)
                gateway.metrics.dropped("overload")
                waiting.get_nowait()
                waiting.put_nowait(None)
            else:
                waiting.put_nowait(f"event: {fact.subject}\ndata: {payload}\n\n")

        async def stream() -> AsyncIterator[str]:
            view.listeners.append(listen)
            try:
                yield ": shift-mesh\n\n"
                while True:
                    try:
                        event = await asyncio.wait_for(waiting.get(), KEEP_ALIVE_S)
                    except TimeoutError:
                        yield ": still here\n\n"
                        continue
                    if event is None:
                        return
                    yield event
            finally:
                if listen in view.listeners:
                    view.listeners.remove(listen)

        given: dict[str, Any] = {"media_type": "text/event-stream", "headers": {"Cache-Control": "no-cache"}}
        return Response(**given) if request.method == "HEAD" else StreamingResponse(stream(), **given)


def _add_recordings(app: FastAPI, gateway: Gateway) -> None:
    @app.get("/v1/recordings", tags=["recordings"])
    async def recordings() -> dict[str, Any]:
        """The recordings that are there."""
        sessions = {s["session"]: s for s in await gateway.api.sessions()}
        return {"recordings": list_recordings(gateway.recordings, sessions)}

    @app.get("/v1/recordings/{name}", tags=["recordings"], response_class=FileResponse)
    async def recording(name: str) -> Response:
        """A recording's file, or its checksum (``NAME.mcap.sha256``)."""
        path = recording_path(gateway.recordings, name)
        if path is None:
            raise UnknownThing(f"there is no recording {name[:80]}")
        media_type = "application/octet-stream" if path.suffix == ".mcap" else "text/plain"
        return FileResponse(path, media_type=media_type, filename=path.name)


def _add_operations(app: FastAPI, gateway: Gateway) -> None:
    @app.get("/healthz", tags=["operations"])
    async def healthz() -> dict[str, str]:
        """The process is up."""
        return {"status": "up"}

    @app.get("/readyz", tags=["operations"])
    async def readyz() -> Response:
        """Whether every service answers and is ready; names those that are not."""
        answers = await asyncio.gather(*(gateway.mesh.health(s) for s in SERVICES))
        content = readiness(dict(zip(SERVICES, answers, strict=True)), gateway.health())
        return JSONResponse(content, 200 if content["ready"] else 503)

    @app.get("/metrics", tags=["operations"])
    async def metrics() -> Response:
        """Prometheus metrics of all services."""
        texts = await asyncio.gather(*(gateway.mesh.metrics(s) for s in (*SERVICES, "ros2_bridge")))
        text = gathered([gateway.metrics_text(), *(t for t in texts if t)])
        return Response(text, media_type="text/plain; version=0.0.4; charset=utf-8")

    @app.get("/", include_in_schema=False)
    async def page() -> HTMLResponse:
        return HTMLResponse(PAGE, headers={"Content-Security-Policy": PAGE_POLICY})
