"""The application: every REST path (docs/interface.md), the live stream and the web page."""

from __future__ import annotations

from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from contextlib import asynccontextmanager

from fastapi import FastAPI, Request, Response
from shift_runtime.bus.protocol import Bus
from shift_runtime.clock import Clock
from shift_schemas.errors import ShiftError

from shift_gateway.command_paths import add_commands
from shift_gateway.docs_page import add_docs
from shift_gateway.event_stream import add_events
from shift_gateway.foxglove.paths import add_foxglove
from shift_gateway.gateway import Gateway
from shift_gateway.gaze_paths import add_gaze
from shift_gateway.operation_paths import add_operations
from shift_gateway.origins import Rules
from shift_gateway.paths import GatewayApp
from shift_gateway.problems import PROBLEM_RESPONSE, BodyLimit, problem_response
from shift_gateway.read_paths import add_reads
from shift_gateway.recordings import add_recordings
from shift_gateway.replay_paths import add_replays
from shift_gateway.settings import GatewaySettings
from shift_gateway.studies import add_studies
from shift_gateway.web.late_mount import PageRoute

Opener = Callable[[], Awaitable[Sequence[Bus]]]


def make_app(settings: GatewaySettings, open_buses: Opener, clock: Clock) -> FastAPI:
    """Return the application. It calls ``open_buses`` when it starts, in its own event loop."""
    gateway = Gateway(settings)
    pages = PageRoute(gateway)

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        async with gateway.on(await open_buses(), clock):
            yield
            await pages.close()

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
    for add in (
        add_commands,
        add_gaze,
        add_reads,
        add_events,
        add_recordings,
        add_replays,
        add_operations,
        add_foxglove,
    ):
        add(app, gateway)
    add_studies(app, settings.data / "studies")
    add_docs(app)
    app.router.routes.append(pages)
    return app


async def _on_shift_error(request: Request, error: Exception) -> Response:
    assert isinstance(error, ShiftError)
    return problem_response(error)
