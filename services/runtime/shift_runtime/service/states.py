"""The states of a service's sessions, in memory."""

from __future__ import annotations

from typing import Generic, TypeVar

from shift_runtime.journal import Journal
from shift_runtime.service.core import Core

S = TypeVar("S")


class SessionStates(Generic[S]):
    """The states of the sessions that are in use. A state is loaded from the journal when it is first needed."""

    def __init__(self, core: Core[S], journal: Journal) -> None:
        self._core = core
        self._journal = journal
        self._loaded: dict[str, S] = {}

    def get(self, session: str) -> S | None:
        """Return the session's state, or None where the service has no state of it."""
        if session not in self._loaded:
            text = self._journal.state(session)
            if text is None:
                return None
            self._loaded[session] = self._core.load(text)
        return self._loaded[session]

    def loaded(self, session: str) -> S | None:
        """Return the session's state if it is in memory; the journal is not read."""
        return self._loaded.get(session)

    def put(self, session: str, state: S) -> None:
        """Replace the session's state in memory."""
        self._loaded[session] = state

    def restore(self, session: str, state: S | None) -> None:
        """Put an earlier state back; None means that the session had no state in memory."""
        if state is None:
            self.unload(session)
        else:
            self._loaded[session] = state

    def unload(self, session: str) -> None:
        """Remove the session's state from memory."""
        self._loaded.pop(session, None)

    def dump(self, session: str) -> str:
        """Return the session's state in memory as text."""
        return self._core.dump(self._loaded[session])

    def __len__(self) -> int:
        """Return how many sessions are in memory."""
        return len(self._loaded)
