"""The paths of running replays: their status, and their control. ``shift-mesh replay`` starts them."""

from __future__ import annotations

from typing import Any

from fastapi import FastAPI, Request
from shift_schemas.errors import check_id
from shift_schemas.messages import ReplayControl

from shift_gateway.gateway import Gateway
from shift_gateway.openapi import documented_body
from shift_gateway.problems import read_body


def add_replays(app: FastAPI, gateway: Gateway) -> None:
    """Add the paths."""

    @app.get("/v1/replays", tags=["recordings"])
    async def replays() -> dict[str, Any]:
        """Return the replays that run."""
        return {"replays": [status.model_dump(mode="json") for status in await gateway.mesh.replays()]}

    @app.get("/v1/replays/{session}", tags=["recordings"])
    async def replay(session: str) -> dict[str, Any]:
        """Return how far a replay is."""
        status = await gateway.mesh.control_replay(check_id("session", session))
        return status.model_dump(mode="json")

    body = documented_body(ReplayControl, ("application/json",))

    @app.patch("/v1/replays/{session}", tags=["recordings"], openapi_extra=body)
    async def control_replay(session: str, request: Request) -> dict[str, Any]:
        """Pause, continue, seek, step, stop, or change the rate of a replay."""
        check_id("session", session)
        status = await gateway.mesh.control_replay(session, await read_body(request, ReplayControl))
        return status.model_dump(mode="json")
