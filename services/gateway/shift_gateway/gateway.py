"""The state that all paths of the gateway share while the application runs."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from pathlib import Path

from shift_runtime.bus.protocol import Bus
from shift_runtime.clock import Clock
from shift_runtime.mesh_client import MeshClient
from shift_runtime.metrics import Metrics
from shift_runtime.read_model import ReadModel
from shift_schemas.codec import encode
from shift_schemas.keys import ServiceKey, build_key
from shift_schemas.messages import Health
from shift_schemas.registry import OWNERS

from shift_gateway.gateway_api import GatewayApi
from shift_gateway.settings import GatewaySettings


class Gateway:
    """The read model, the client of the mesh and the metrics of one gateway."""

    api: GatewayApi
    read_model: ReadModel
    mesh: MeshClient

    def __init__(self, settings: GatewaySettings) -> None:
        self.settings = settings
        self.metrics = Metrics("gateway")

    @property
    def recordings(self) -> Path:
        """The folder of the finished recordings."""
        return self.settings.data / "recordings"

    @asynccontextmanager
    async def on(self, buses: Sequence[Bus], clock: Clock) -> AsyncIterator[None]:
        """Read the mesh and answer on the bus of each shard, until the context is left."""
        self.mesh = MeshClient(buses, self.settings.patience_s)
        self.read_model = ReadModel(buses, self.metrics.dropped, self.metrics.link_lost)
        self.api = GatewayApi(self.mesh, self.read_model, clock)
        for bus in buses:
            bus.serve(build_key(ServiceKey("gateway", "health")), lambda r: r.reply(encode(self.health())))
            bus.serve(build_key(ServiceKey("gateway", "metrics")), lambda r: r.reply(self.metrics_text()))
            bus.token(build_key(ServiceKey("gateway", "alive")))
        self.read_model.reader.start()
        reading = asyncio.create_task(self.read_model.reader.run())
        try:
            yield
        finally:
            reading.cancel()
            await asyncio.gather(*(bus.close() for bus in buses))

    def metrics_text(self) -> bytes:
        """Return the gateway's own metrics."""
        for owner in OWNERS:
            self.metrics.silent(owner, self.read_model.reader.silent_s(owner))
        return self.metrics.text()

    def health(self) -> Health:
        """Return the gateway's own health."""
        missing = self.read_model.missing
        unreached = self.read_model.reader.unreached
        detail = f"waits for the {', the '.join(missing)}" if missing else ""
        if not detail and unreached:
            detail = f"the gateway does not reach the {', the '.join(unreached)}"
        sessions = len(self.read_model.views)
        return Health(service="gateway", ready=not detail, detail=detail, sessions=sessions, unreached=unreached)
