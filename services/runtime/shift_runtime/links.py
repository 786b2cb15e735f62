"""Links: which owners a reader reaches, and how lost links are made again.

Processes link directly once they have met at the router. When a process was suspended for longer than the transport's
lease (10 s), the others have dropped their links to it, and Zenoh does not always make them again. So each reader knows
when each owner last answered it. If an owner answers through the router only, the direct link is lost and the bus is
reopened. If an owner does not answer at all, it hangs or has stopped, and reopening the bus would not help.
"""

from __future__ import annotations

import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field

import structlog
from shift_schemas.errors import InvalidSettings
from shift_schemas.keys import ServiceKey, build_key

from shift_runtime.bus.protocol import Bus

log = structlog.get_logger()

SILENT_S = 2.5
"""After so long without an answer an owner is unreached; chosen: five pulls, and the pause of a restart."""
REOPEN_PAUSE_S = 3.0
"""The time between two attempts to reopen the bus; chosen: a new session meets the others within half a second."""


@dataclass
class Links:
    """The links of one reader to the owners that it reads."""

    bus: Bus
    owners: tuple[str, ...]
    lost: Callable[[str], None] = lambda owner: None
    """Called with each owner that is not reached any more."""
    now: Callable[[], float] = time.monotonic
    answered_at: dict[str, float] = field(default_factory=dict)
    _known_lost: set[str] = field(default_factory=set)
    _reopened_at: float = 0.0

    def answered(self, owner: str) -> None:
        """Note that an owner answered."""
        self.answered_at[owner] = self.now()
        if owner in self._known_lost:
            self._known_lost.discard(owner)
            log.info("an owner answers again", owner=owner)

    def silent_s(self, owner: str) -> float:
        """Return the seconds since an owner last answered; 0 for one that never did, which may still be starting."""
        return self.now() - self.answered_at.get(owner, self.now())

    @property
    def unreached(self) -> list[str]:
        """The owners that have answered before and do not answer any more."""
        return [owner for owner in self.owners if self.silent_s(owner) > SILENT_S]

    async def keep(self, pull: Callable[[str], Awaitable[bool]]) -> None:
        """Check the links once; it is called after each round of pulls. ``pull`` asks an owner directly."""
        unreached = self.unreached
        for owner in unreached:
            if owner not in self._known_lost:
                self._known_lost.add(owner)
                self.lost(owner)
                log.warning("an owner does not answer", owner=owner, silent_s=round(self.silent_s(owner), 1))
        if not unreached or self.now() - self._reopened_at < REOPEN_PAUSE_S:
            return
        for owner in unreached:
            by_router = await self.bus.answers_by_router(build_key(ServiceKey(owner, "health")))
            if by_router and not await pull(owner):
                await self._reopen(owner)
                return

    async def _reopen(self, owner: str) -> None:
        log.warning("the link to an owner is lost, and it answers through the router: the bus is reopened", owner=owner)
        self._reopened_at = self.now()
        try:
            await self.bus.reopen()
        except InvalidSettings as e:
            log.error("the bus cannot be reopened", error=e.detail)
