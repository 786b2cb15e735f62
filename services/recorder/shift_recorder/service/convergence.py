"""Convergence: at a session's end, every service has read everything that the others published before it."""

from __future__ import annotations

from collections.abc import Mapping

from shift_runtime.polling import poll
from shift_runtime.reader import SESSION_OWNER, Reader
from shift_runtime.service.progress import Progress
from shift_schemas.errors import Conflict, Unavailable
from shift_schemas.messages import OutboxPage
from shift_schemas.registry import OWNERS, READS

END_WAIT_S = 3.5
"""How long an end waits for the other services, s; the gateway waits longer, so that the client receives the reason."""
ASK_AGAIN_S = 0.02
PEERS = tuple(owner for owner in OWNERS if owner != SESSION_OWNER)
"""The services that must have caught up."""


class Convergence:
    """Compares how far each service has read with how much each has published."""

    def __init__(self, reader: Reader, progress: Progress) -> None:
        self._reader = reader
        self._progress = progress

    async def reach(self, session: str) -> None:
        """Read until every service has read the end of the session and everything before it.

        Raises
        ------
        Unavailable
            A service does not answer or has not caught up within :data:`END_WAIT_S`.
        Conflict
            The journals do not fit together.
        """
        silent: tuple[str, ...] = ()

        async def reached() -> bool:
            nonlocal silent
            silent = await self._reader.pull_all(OWNERS, session)
            return not silent and not self.behind(session) and not self._misfit(session)

        if await poll(reached, timeout_s=END_WAIT_S, pause_s=ASK_AGAIN_S):
            return
        if not silent and (misfit := self._misfit(session)):
            raise Conflict(misfit)
        slow = (silent or self.behind(session))[0]
        why = "does not answer" if silent else "has not caught up"
        raise Unavailable(f"session {session} cannot end yet: the {slow} {why}; ask again")

    def behind(self, session: str) -> tuple[str, ...]:
        """Return the owners whose facts the recorder has not processed, else the services that have not caught up."""
        pages = self._pages(session)
        processed = self._progress.processed
        unread = tuple(o for o, page in pages.items() if processed.get((session, o), 0) < page.heads.get(session, 0))
        return unread or tuple(peer for peer in PEERS if _has_not_read(peer, pages, session))

    def missing(self, session: str, counts: Mapping[str, int]) -> tuple[str, ...]:
        """Return the owners of whom a recording with so many messages per subject lacks something."""
        heads = {owner: page.heads[session] for owner, page in self._pages(session).items()}
        heads[SESSION_OWNER] += 1  # the recording has its own version of the end
        recorded = {owner: sum(counts.get(subject, 0) for subject in OWNERS[owner]) for owner in OWNERS}
        return tuple(owner for owner in OWNERS if recorded[owner] != heads[owner])

    def _pages(self, session: str) -> dict[str, OutboxPage]:
        return {owner: self._reader.pages[f"{owner}/{session}"] for owner in OWNERS}

    def _misfit(self, session: str) -> str:
        """Return a sentence where a service has read more facts of another one than that one has published."""
        pages = self._pages(session)
        for peer in PEERS:
            for owner, read in pages[peer].cursors.get(session, {}).items():
                head = pages[owner].heads.get(session, 0)
                if read > head:
                    return (
                        f"session {session} cannot end: the {peer} has read {read} messages of the {owner}, whose "
                        f"journal ends at {head}: the data folder was copied while a mesh used it; end the session on "
                        "the original"
                    )
        return ""


def _has_not_read(peer: str, pages: Mapping[str, OutboxPage], session: str) -> bool:
    cursors = pages[peer].cursors.get(session, {})
    return any(cursors.get(owner, 0) < pages[owner].heads.get(session, 0) for owner in READS[peer])
