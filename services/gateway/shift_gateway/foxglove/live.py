"""Running sessions for a Foxglove client: each fact as it happens, and the latest one at a new subscription."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator

from shift_recording.mcap.schemas import recorded_json, schema_name, subject_schemas
from shift_runtime.read_model import Listener, ReadModel, SessionView
from shift_schemas.lifecycle import has_ended
from shift_schemas.messages import Fact
from shift_schemas.registry import SUBJECTS

from shift_gateway.foxglove.connection import Connection
from shift_gateway.foxglove.protocol import Channel, Request, Subscribe, Unsubscribe, time_of

LOOK_EVERY_S = 0.5
"""How often new and ended sessions are looked for, and the time is sent; chosen, as a person notices a delay."""


class LiveSessions:
    """The facts of one session, or of all running ones.

    Parameters
    ----------
    only
        The session whose topics are ``/SUBJECT``; None for all running sessions, with the topics ``/SESSION/SUBJECT``.
    """

    def __init__(
        self, connection: Connection, read_model: ReadModel, only: str | None, now_ns: Callable[[], int]
    ) -> None:
        self._connection = connection
        self._read_model = read_model
        self._only = only
        self._now_ns = now_ns
        self._first: dict[str, int] = {}
        """By session: the id of the channel of its first subject."""
        self._listeners: dict[str, tuple[SessionView, Listener]] = {}
        self._next = 1

    async def run(self) -> None:
        """Offer sessions as they begin and take them back as they end, until this is cancelled."""
        try:
            while True:
                self._look()
                self._connection.send(time_of(self._now_ns()))
                await asyncio.sleep(LOOK_EVERY_S)
        finally:
            for session in list(self._listeners):
                self._leave(session)

    def _look(self) -> None:
        views = self._read_model.views
        wanted = {
            name
            for name, view in views.items()
            if view.config is not None and (name == self._only if self._only else not has_ended(view.fact.state))
        }
        for session in [name for name in self._first if name not in wanted]:
            self._leave(session)
        for session in sorted(wanted - self._first.keys()):
            self._follow(session, views[session])

    def _follow(self, session: str, view: SessionView) -> None:
        first = self._first[session] = self._next
        self._next += len(SUBJECTS)
        states = tuple(view.policy.states) if view.policy is not None else ()
        schemas = subject_schemas(view.study, states)
        prefix = "" if self._only else f"/{session}"
        self._connection.offer(
            Channel(first + i, f"{prefix}/{subject}", schema_name(subject), schemas[subject].decode())
            for i, subject in enumerate(SUBJECTS)
        )

        def listen(fact: Fact, payload: str) -> None:
            channel = first + SUBJECTS.index(fact.subject)
            if channel in self._connection.subscribed:
                self._connection.publish(channel, fact.stamp.ns, recorded_json(fact))

        view.listeners.append(listen)
        self._listeners[session] = (view, listen)

    def _leave(self, session: str) -> None:
        view, listen = self._listeners.pop(session)
        if listen in view.listeners:
            view.listeners.remove(listen)
        first = self._first.pop(session)
        self._connection.withdraw(range(first, first + len(SUBJECTS)))

    def apply(self, request: Request) -> None:
        """Carry out a request; a new subscription gets the latest fact."""
        if not isinstance(request, Subscribe | Unsubscribe):
            return
        for channel in self._connection.apply(request):
            for fact in self._latest(channel):
                self._connection.publish(channel, fact.stamp.ns, recorded_json(fact))

    def _latest(self, channel: int) -> Iterator[Fact]:
        """Yield the latest fact of a channel, if the read model keeps it."""
        for session, first in self._first.items():
            if first <= channel < first + len(SUBJECTS):
                view = self._listeners[session][0]
                kept = (view.fact, view.config, view.observation, view.policy)
                yield from (f for f in kept if f is not None and f.subject == SUBJECTS[channel - first])
