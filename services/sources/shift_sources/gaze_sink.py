"""Where gaze of a source goes. Programs that are part of the mesh send it to the monitor."""

from __future__ import annotations

from typing import Any, Protocol

from shift_runtime.mesh_api import MeshApi
from shift_schemas.errors import Unavailable
from shift_schemas.messages import GazeChunk


class GazeSink(Protocol):
    """Takes chunks of gaze. A chunk that is sent again under its number counts once."""

    async def gaze(self, session: str, chunk: GazeChunk) -> Any:
        """Send a chunk; it is kept when this returns. Raises :class:`ShiftError`."""

    async def next_seq(self, session: str, source: str) -> int:
        """Return the number that follows the source's last chunk. Raises :class:`ShiftError`."""


class MeshSink:
    """A sink of a program that is part of the mesh."""

    def __init__(self, mesh: MeshApi) -> None:
        self._mesh = mesh

    async def gaze(self, session: str, chunk: GazeChunk) -> Any:
        """Send a chunk to the monitor."""
        return await self._mesh.gaze(session, chunk)

    async def next_seq(self, session: str, source: str) -> int:
        """Return the next number, as the monitor has read it. Raises :class:`Unavailable` if it does not answer."""
        read_model = self._mesh.read_model
        view = await read_model.view(session)
        if not await read_model.reader.pull("monitor"):
            raise Unavailable("the monitor does not answer, so the last number of this gaze source is not known")
        return view.observation.seen.gaze.get(source, -1) + 1 if view.observation else 0
