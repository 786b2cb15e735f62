"""The paths for operators: liveness, readiness and metrics."""

from __future__ import annotations

import asyncio
import itertools

from fastapi import FastAPI, Response
from fastapi.responses import JSONResponse
from shift_schemas.registry import OWNERS

from shift_gateway.gateway import Gateway
from shift_gateway.merged_metrics import merged_metrics
from shift_gateway.readiness import readiness


def add_operations(app: FastAPI, gateway: Gateway) -> None:
    """Add the paths."""

    @app.get("/healthz", tags=["operations"])
    async def healthz() -> dict[str, str]:
        """Answer that the process is up."""
        return {"status": "up"}

    @app.get("/readyz", tags=["operations"])
    async def readyz() -> Response:
        """Return whether every service answers and is ready; names those that are not."""
        content = readiness(await gateway.mesh.healths(), gateway.health())
        return JSONResponse(content, 200 if content["ready"] else 503)

    @app.get("/metrics", tags=["operations"])
    async def metrics() -> Response:
        """Return the Prometheus metrics of all services."""
        texts = await asyncio.gather(*(gateway.mesh.metrics(service) for service in (*OWNERS, "ros2_bridge")))
        text = merged_metrics([gateway.metrics_text(), *itertools.chain.from_iterable(texts)])
        return Response(text, media_type="text/plain; version=0.0.4; charset=utf-8")
