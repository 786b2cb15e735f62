"""The history of a session, as an open page reads it, in a mesh on the in-memory bus."""

from __future__ import annotations

from shift_gateway.gateway import Gateway
from shift_gateway.settings import GatewaySettings
from shift_gateway.web.history import SessionHistory
from shift_gateway.web.live_histories import LiveHistories
from shift_runtime.bus.memory import MemoryBus

from support.gateway_mesh import Session


async def history_of(session: Session) -> SessionHistory:
    """Return the session's history so far, read by a second gateway."""
    mesh = session.mesh
    gateway = Gateway(GatewaySettings(data=mesh.data))
    async with gateway.on([MemoryBus(mesh.hub)], mesh.clock):
        return await LiveHistories(gateway).open(session.name)
