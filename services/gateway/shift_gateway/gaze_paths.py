"""The paths of the streams: gaze, a chunk in each POST or in each message of a WebSocket, and AOIs that move."""

from __future__ import annotations

from typing import Any

from fastapi import FastAPI, Request, WebSocket, WebSocketDisconnect
from shift_schemas.errors import ShiftError, check_id
from shift_schemas.messages import AoiPositions, GazeChunk

from shift_gateway.gateway import Gateway
from shift_gateway.openapi import documented_body
from shift_gateway.problems import check_size, parse_body, problem_body, read_body


def add_gaze(app: FastAPI, gateway: Gateway) -> None:
    """Add the paths."""

    @app.post(
        "/v1/sessions/{session}/gaze", status_code=202, tags=["interaction"], openapi_extra=documented_body(GazeChunk)
    )
    async def post_gaze(session: str, request: Request) -> dict[str, Any]:
        """Send a chunk of gaze, points or AOI names."""
        await gateway.read_model.view(check_id("session", session))
        return await gateway.api.gaze(session, await read_body(request, GazeChunk))

    @app.post(
        "/v1/sessions/{session}/aois", status_code=202, tags=["interaction"],
        openapi_extra=documented_body(AoiPositions),
    )  # fmt: skip
    async def post_aois(session: str, request: Request) -> dict[str, Any]:
        """Move areas of interest, from a time of the gaze source's clock on."""
        await gateway.read_model.view(check_id("session", session))
        return await gateway.api.aois(session, await read_body(request, AoiPositions))

    @app.websocket("/v1/sessions/{session}/gaze")
    async def stream_gaze(socket: WebSocket, session: str) -> None:
        await socket.accept()
        try:
            while True:
                arrived = await socket.receive()
                if arrived["type"] == "websocket.disconnect":
                    return
                raw = arrived.get("text") or arrived.get("bytes") or ""
                await socket.send_json(await _answer(gateway, session, raw))
        except WebSocketDisconnect:
            return


async def _answer(gateway: Gateway, session: str, raw: str | bytes) -> dict[str, Any]:
    """Return the answer to one message of a WebSocket: what was accepted, or a problem document."""
    try:
        await gateway.read_model.view(check_id("session", session))
        check_size(len(raw))
        chunk = parse_body(raw, GazeChunk)
        return {**await gateway.api.gaze(session, chunk), "seq": chunk.seq}
    except ShiftError as e:
        return problem_body(e)
