"""The histories of the sessions that a page shows now. Without an open page there is none, and nothing is kept."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, field

from shift_runtime.read_model import SessionView
from shift_runtime.reader import fact_of
from shift_schemas.errors import Unavailable
from shift_schemas.lifecycle import has_ended
from shift_schemas.messages import Fact, Observation, OutboxQuery
from shift_schemas.registry import OWNERS

from shift_gateway.gateway import Gateway
from shift_gateway.web.history import SessionHistory
from shift_gateway.web.outbox import outbox_page

TAIL = {Observation.owner: 6000}
"""The owner of gaze is read from this many messages before its end: about five minutes at eight chunks a second."""


@dataclass
class _Followed:
    """One session that at least one page shows."""

    history: SessionHistory = field(default_factory=SessionHistory)
    pages: int = 0
    loading: asyncio.Task[None] | None = None
    waiting: list[Fact] | None = field(default_factory=list)
    """Facts that came while the earlier ones were read; None afterwards."""

    def on_fact(self, fact: Fact, payload: str) -> None:
        """Apply a fact of the read model."""
        if self.waiting is not None:
            self.waiting.append(fact)
        else:
            self.history.apply(fact)


class LiveHistories:
    """Reads a session from its start when the first page shows it, and follows it until the last page is closed."""

    def __init__(self, gateway: Gateway) -> None:
        self._gateway = gateway
        self._followed: dict[str, _Followed] = {}

    async def open(self, session: str) -> SessionHistory:
        """Return the history of a session, read from its start. :meth:`close` must follow.

        Raises
        ------
        UnknownThing
            There is no such session.
        Unavailable
            A service does not answer.
        """
        view = await self._gateway.read_model.view(session)
        followed = self._followed.get(session)
        if followed is None:
            followed = self._followed[session] = _Followed()
            followed.loading = asyncio.create_task(self._load(session, view, followed))
        followed.pages += 1
        assert followed.loading is not None
        try:
            await asyncio.shield(followed.loading)
        except BaseException:
            self.close(session)
            raise
        return followed.history

    def close(self, session: str) -> None:
        """Forget the session if no other page shows it."""
        followed = self._followed[session]
        followed.pages -= 1
        if followed.pages == 0:
            del self._followed[session]
            assert followed.loading is not None
            followed.loading.cancel()
            view = self._gateway.read_model.views.get(session)
            if view is not None and followed.on_fact in view.listeners:
                view.listeners.remove(followed.on_fact)

    async def _load(self, session: str, view: SessionView, followed: _Followed) -> None:
        """Read what the read model has read already, and then apply what came meanwhile."""
        await self._read_model_has_ended_session(session, view)
        cursors = {owner: self._gateway.read_model.reader.cursor(session, owner) or 0 for owner in OWNERS}
        view.listeners.append(followed.on_fact)
        for owner, cursor in cursors.items():
            await self._read(session, owner, cursor, followed.history)
        waiting, followed.waiting = followed.waiting or [], None
        for fact in waiting:
            followed.history.apply(fact)

    async def _read_model_has_ended_session(self, session: str, view: SessionView) -> None:
        """Have the read model read a session that ended before this gateway started: it does so only when asked."""
        reader = self._gateway.read_model.reader
        unread = [owner for owner in OWNERS if reader.cursor(session, owner) is None]
        if has_ended(view.fact.state) and unread and (silent := await reader.pull_all(unread, session)):
            raise Unavailable(f"the {silent[0]} does not answer")

    async def _read(self, session: str, owner: str, last: int, history: SessionHistory) -> None:
        first = max(0, last - TAIL.get(owner, last))
        while first < last:
            query = OutboxQuery(cursors={session: first}, only=[session], closed=True)
            page = await outbox_page(self._gateway.mesh.bus_of(session), owner, query)
            for row in page.rows:
                if first < row.seq <= last:
                    history.apply(fact_of(row))
            if not page.rows:
                return
            first = page.rows[-1].seq
            await asyncio.sleep(0)
