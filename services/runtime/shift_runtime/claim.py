"""The claim on a key space: each owner is there once, on all routers that are joined.

Two meshes on one router would answer each other's requests and record each other's sessions. So a service asks, before
it answers anything, whether another one answers under its key, and again now and then: two can start at the same
moment, and two routers can be joined later. A data folder has an id of its own; an answer with another id is another
mesh's. Then the one that began later yields. A service that comes back after a crash has the id that it had.
"""

from __future__ import annotations

import asyncio
import os
import secrets
from collections.abc import Iterator
from pathlib import Path

from shift_schemas.codec import decode
from shift_schemas.errors import InvalidSettings, MalformedMessage
from shift_schemas.keys import ServiceKey, build_key
from shift_schemas.messages import Health
from shift_schemas.timestamps import Stamp

from shift_runtime.bus.protocol import Bus, Reply
from shift_runtime.polling import poll

JOIN_WAIT_S = 1.0
"""How long a service waits for its first link before it begins without having asked; it asks again later."""
ASK_S = 1.0
LOOK_AGAIN_S = (0.5, 1.5, 3.0)
"""Pauses before it is asked again; the last one goes on."""


class OwnedElsewhere(InvalidSettings):
    """Another mesh owns what this service would own."""

    title = "Two meshes share one router"


def mesh_id(folder: Path) -> str:
    """Return the id of a data folder, made once and kept in ``folder/mesh-id``.

    Raises
    ------
    OSError
        The folder cannot be read or written.
    """
    path, own = folder / "mesh-id", folder / f".mesh-id-{secrets.token_hex(4)}"
    if not path.exists():
        try:
            own.write_text(secrets.token_hex(8))
            os.link(own, path)  # whole or not at all; of several services that begin at once, one makes it
        except FileExistsError:
            pass
        finally:
            own.unlink(missing_ok=True)
    return path.read_text().strip()


class Claim:
    """One service's claim. ``since`` is when its process began, ``mesh`` its data folder's id."""

    def __init__(self, bus: Bus, service: str, mesh: str, since: Stamp) -> None:
        self.bus = bus
        self.service = service
        self.mesh = mesh
        self.since = since
        self.conflict = ""
        """A sentence while another one answers that began later and has not yielded yet."""

    async def make(self) -> None:
        """Ask before anything is answered. Raises :class:`OwnedElsewhere` where another mesh has the key."""
        await poll(self._joined, timeout_s=JOIN_WAIT_S, pause_s=0.01)
        for other in await self._others():
            raise OwnedElsewhere(self._refusal(other))

    async def keep(self) -> None:
        """Ask now and then, for ever. Raises :class:`OwnedElsewhere` where this one must yield."""
        pauses = [*LOOK_AGAIN_S]
        while True:
            await asyncio.sleep(pauses.pop(0) if len(pauses) > 1 else pauses[0])
            others = await self._others()
            for other in others:
                if other.since is None or (other.since.ns, other.mesh) < (self.since.ns, self.mesh):
                    raise OwnedElsewhere(self._refusal(other))
            self.conflict = self._warning(others[0]) if others else ""

    async def _joined(self) -> bool:
        return self.bus.joined

    async def _others(self) -> list[Health]:
        replies = await self.bus.get(build_key(ServiceKey(self.service, "health")), timeout_s=ASK_S)
        return [health for health in healths_of(replies) if health.mesh != self.mesh]

    def _refusal(self, other: Health) -> str:
        return (
            f"another {self.service} answers on this router already, with the data folder {other.data or 'unknown'}: "
            "two meshes cannot share a router; stop the other one, or give this one a router of its own with --zenoh"
        )

    def _warning(self, other: Health) -> str:
        return f"another {self.service} answers on this router, with the data folder {other.data or 'unknown'}; stop it"


def healths_of(replies: list[Reply]) -> Iterator[Health]:
    """Yield the health of each service among these replies."""
    for reply in replies:
        try:
            if reply.ok:
                yield decode(Health, reply.payload)
        except MalformedMessage:  # not one of ours
            continue


def one_health(service: str, found: list[Health]) -> Health | None:
    """Return what can be said of a service, of which there may be none or two."""
    if len({health.mesh for health in found}) < 2:
        return found[0] if found else None
    folders = " and ".join(sorted(health.data or "unknown" for health in found))
    detail = (
        f"{len(found)} services answer as the {service}, with the data folders {folders}: two meshes share this "
        "router; stop one of them"
    )
    return found[0].model_copy(update={"ready": False, "detail": detail})
