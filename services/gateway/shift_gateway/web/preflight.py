"""What the pre-flight list asks the mesh, at most once a second for all open start pages together."""

from __future__ import annotations

import asyncio
import shutil
import time

from shift_runtime.bus.protocol import Bus
from shift_schemas.errors import Unavailable
from shift_schemas.lifecycle import has_ended
from shift_schemas.messages import OutboxQuery
from shift_schemas.registry import OWNERS

from shift_gateway.gateway import Gateway
from shift_gateway.web.outbox import outbox_page
from shift_gateway.web.start_view import Check, disk_check, lag_check, service_check

ASK_EVERY_S = 1.0


class Preflight:
    """The checks of the services, the recorder's lag and the disk."""

    def __init__(self, gateway: Gateway) -> None:
        self._gateway = gateway
        self._heard: dict[str, int] = {}
        self._asked = -ASK_EVERY_S
        self._checks: list[Check] = []
        self._asking: asyncio.Task[list[Check]] | None = None

    async def checks(self) -> list[Check]:
        """Return the checks; they are asked for anew if they are older than a second."""
        if self._asking is None or (self._asking.done() and time.monotonic() - self._asked >= ASK_EVERY_S):
            self._asked = time.monotonic()
            self._asking = asyncio.create_task(self._ask())
        return await asyncio.shield(self._asking)

    async def _ask(self) -> list[Check]:
        now_ns = self._gateway.api.clock.now().ns
        found = await self._gateway.mesh.healths()
        found["gateway"] = self._gateway.health()
        for name, health in found.items():
            if health is not None:
                self._heard[name] = now_ns
        checks = [service_check(name, health, self._heard.get(name)) for name, health in found.items()]
        disk = await asyncio.to_thread(shutil.disk_usage, self._gateway.settings.data)
        return [*checks, lag_check(await self._behind(), now_ns), disk_check(disk.free, disk.total, now_ns)]

    async def _behind(self) -> int | None:
        """Return how many messages of live sessions the recorder has not read yet; None if it does not answer."""
        mesh, views = self._gateway.mesh, self._gateway.read_model.views
        live = [name for name, view in views.items() if not has_ended(view.fact.state)]
        shards = [(bus, [name for name in live if mesh.bus_of(name) is bus]) for bus in mesh.buses]
        try:
            return sum(await asyncio.gather(*(self._behind_in(bus, sessions) for bus, sessions in shards)))
        except Unavailable:
            return None

    async def _behind_in(self, bus: Bus, sessions: list[str]) -> int:
        """Return how many messages of these sessions the recorder of one shard has not read yet."""
        reader = self._gateway.read_model.reader
        heads = {(name, owner): reader.cursor(name, owner) or 0 for name in sessions for owner in OWNERS}
        cursors = {name: heads[name, "recorder"] for name in sessions}
        page = await outbox_page(bus, "recorder", OutboxQuery(cursors=cursors, only=sessions, limit=1))
        return sum(
            max(n - page.cursors[name].get(owner, 0), 0)
            for (name, owner), n in heads.items()
            if owner != "recorder" and name in page.cursors
        )
