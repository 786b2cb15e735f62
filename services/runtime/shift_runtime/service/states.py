"""The states of a service's sessions, in memory."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Generic, TypeVar

from shift_runtime.journal import Journal
from shift_runtime.service.core import Core

S = TypeVar("S")


class SessionStates(Generic[S]):
    """The states of the sessions that are in use. A state is loaded from the journal when it is first needed."""

    def __init__(self, core: Core[S], journal: Journal) -> None:
        self._core = core
        self._journal = journal
        self._loaded: dict[str, S] = {}
        self._kept: dict[str, Mapping[str, Any]] = {}
        """By session, the parts that the journal has."""

    def get(self, session: str) -> S | None:
        """Return the session's state, or None where the service has no state of it."""
        if session not in self._loaded:
            text = self._journal.state(session)
            if text is None:
                return None
            self._loaded[session] = self._restored(session, self._core.load(text))
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
        self._kept.pop(session, None)

    def dump(self, session: str) -> str:
        """Return the session's state in memory as text, without the parts that are kept apart."""
        state = self._loaded[session]
        return self._core.dump(state if self._core.parts is None else self._core.parts.without(state))

    def changed_parts(self, session: str) -> dict[str, str | None]:
        """Return the parts that differ from those in the journal, as texts; None for a part that is gone."""
        parts = self._core.parts
        if parts is None:
            return {}
        before, now = self._kept.get(session, {}), parts.of(self._loaded[session])
        changed: dict[str, str | None] = {
            name: parts.dump(part) for name, part in now.items() if before.get(name) is not part
        }
        return changed | dict.fromkeys(before.keys() - now.keys())

    def committed(self, session: str) -> None:
        """Note that the journal has the session's state."""
        if self._core.parts is not None and session in self._loaded:
            self._kept[session] = self._core.parts.of(self._loaded[session])

    def _restored(self, session: str, state: S) -> S:
        """Return the state with its parts. A journal of an earlier version has them in the state itself."""
        parts = self._core.parts
        texts = self._journal.parts(session) if parts is not None else {}
        if parts is None or not texts:
            return state
        restored = parts.restore(state, texts)
        self._kept[session] = parts.of(restored)
        return restored

    def __len__(self) -> int:
        """Return how many sessions are in memory."""
        return len(self._loaded)
