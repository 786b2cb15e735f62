"""Waiting: requests are parked until their inputs arrive, and the owners of those inputs are pulled meanwhile."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Iterable
from typing import Any, Protocol

from shift_schemas.core_protocol import InputsMissing
from shift_schemas.errors import Unavailable

from shift_runtime.reader import SESSION_OWNER
from shift_runtime.service.background import BackgroundTasks
from shift_runtime.service.requests import PendingRequest

NOTIFICATION_WAIT_S = 0.05
"""How long a parked request expects a notification before the owner's outbox is pulled."""


class Puller(Protocol):
    """The part of a reader that pulls."""

    @property
    def owners(self) -> tuple[str, ...]:
        """The owners that the service reads."""

    def pull_soon(self, owner: str, session: str | None = None, current: bool = False) -> Any:
        """Read the owner's outbox, or one session of it, in the background."""

    def pull(self, owner: str) -> Awaitable[bool]:
        """Read the owner's outbox to its end; return whether it answered."""

    def pull_all(self, owners: Iterable[str]) -> Awaitable[tuple[str, ...]]:
        """Read several outboxes; return the owners that did not answer."""


class Waiting:
    """The parked requests of a service, by session. ``resume`` puts a request before the worker again."""

    def __init__(
        self, service: str, reader: Puller, tasks: BackgroundTasks, resume: Callable[[PendingRequest], None]
    ) -> None:
        self._service = service
        self._reader = reader
        self._tasks = tasks
        self._resume = resume
        self._parked: dict[str, list[PendingRequest]] = {}

    def park(self, request: PendingRequest, missing: InputsMissing) -> None:
        """Keep a request until its session's inputs change or its time is over; pull the owners that it waits for.

        The time counts from the first call: a request that is parked again keeps its deadline.
        """
        loop = asyncio.get_running_loop()
        if request.deadline is None:
            request.deadline = loop.time() + missing.give_up_s
            loop.call_later(missing.give_up_s, self._give_up, request)
            loop.call_later(min(NOTIFICATION_WAIT_S, missing.give_up_s / 2), self._pull_for, request, missing.owners)
            for owner in missing.holding:
                self._reader.pull_soon(owner, request.session, current=True)
        self._parked.setdefault(request.session, []).append(request)

    def release(self, session: str) -> list[PendingRequest]:
        """Remove and return the session's parked requests, oldest first."""
        return self._parked.pop(session, [])

    def join(self, request: PendingRequest) -> bool:
        """Let those who ask wait for an equal command that is parked; return whether there is one."""
        for parked in self._parked.get(request.session, ()):
            if parked.key == request.key and parked.message == request.message:
                parked.requests += request.requests
                return True
        return False

    def read_again(self, owner: str) -> None:
        """Pull an owner whose facts came before their session: the session's owner first, then this one."""

        async def pull_in_order() -> None:
            if await self._reader.pull(SESSION_OWNER):
                await asyncio.sleep(NOTIFICATION_WAIT_S)
                await self._reader.pull(owner)

        self._tasks.start(pull_in_order())

    def resume_after_check(self, request: PendingRequest) -> None:
        """Pull every owner once and resume the request: something is unknown only when no owner has said it.

        Without the session's owner nobody can say what is unknown, and the request is refused as unavailable.
        """
        request.checked = True

        async def check() -> None:
            silent = await self._reader.pull_all(self._reader.owners)
            if SESSION_OWNER in silent:
                why = f"the {self._service} cannot know yet: the {silent[0]} does not answer"
                request.refuse(Unavailable(why))
                return
            self._resume(request)

        self._tasks.start(check())

    def _pull_for(self, request: PendingRequest, owners: tuple[str, ...]) -> None:
        if request not in self._parked.get(request.session, ()):
            return
        for owner in owners:
            if owner in self._reader.owners:
                self._reader.pull_soon(owner)
        asyncio.get_running_loop().call_later(4 * NOTIFICATION_WAIT_S, self._pull_for, request, owners)

    def _give_up(self, request: PendingRequest) -> None:
        parked = self._parked.get(request.session, [])
        if request in parked:
            parked.remove(request)
            request.timed_out = True
            self._resume(request)
