"""Where gaze of a live source goes: through the gateway, since the source is no part of the mesh."""

from __future__ import annotations

import asyncio
from typing import Any

from shift_runtime.rest_client import RestClient
from shift_schemas.messages import GazeChunk


class GatewaySink:
    """A sink of a program outside of the mesh. The client's patience is how long it waits for the mesh."""

    def __init__(self, rest: RestClient) -> None:
        self._rest = rest

    async def gaze(self, session: str, chunk: GazeChunk) -> Any:
        """Send a chunk to the gateway."""
        return await asyncio.to_thread(self._rest.gaze, session, chunk)

    async def next_seq(self, session: str, source: str) -> int:
        """Return the next number, as an observation has seen it."""
        observation = await asyncio.to_thread(self._rest.observation, session)
        return int(observation["seen"]["gaze"].get(source, -1)) + 1
