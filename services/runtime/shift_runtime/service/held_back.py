"""What a core holds back: it is published when a reader asks for it, or after a while."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from typing import Generic, TypeVar

from shift_runtime.clock import Clock
from shift_runtime.service.core import Core
from shift_runtime.service.states import SessionStates
from shift_runtime.service.transaction import Transactions

S = TypeVar("S")

WITHIN_S = 0.25
"""Chosen: what nobody asks for is published after this time, so that a page shows the last gaze of a source that
stopped."""


class HeldBack(Generic[S]):
    """The sessions whose core holds something back.

    Parameters
    ----------
    schedule
        Runs a function in the worker's turn; a commit follows.
    """

    def __init__(
        self,
        core: Core[S],
        states: SessionStates[S],
        transactions: Transactions[S],
        clock: Clock,
        schedule: Callable[[Callable[[], None]], None],
    ) -> None:
        self._core = core
        self._states = states
        self._transactions = transactions
        self._clock = clock
        self._schedule = schedule
        self._since: dict[str, float] = {}
        """By session, since when something is held back, on the loop's clock."""
        self._timing = False
        self._replies: list[Callable[[], None]] = []

    def note(self, session: str, state: S) -> None:
        """Note a session's new state."""
        if self._core.held(state) is None:
            self._since.pop(session, None)
        elif session not in self._since:
            self._since[session] = asyncio.get_running_loop().time()
            self._wake_later()

    def publish_for(self, sessions: Sequence[str], reply: Callable[[], None]) -> None:
        """Publish what is held back of these sessions, and call ``reply`` after the commit."""

        def publish() -> None:
            for session in sessions:
                self._publish(session)
            self._replies.append(reply)

        self._schedule(publish)

    def after_commit(self) -> None:
        """Reply to those who asked. It is called after every turn."""
        replies, self._replies = self._replies, []
        for reply in replies:
            reply()

    def _publish(self, session: str) -> None:
        self._since.pop(session, None)
        state = self._states.get(session)
        event = self._core.held(state) if state is not None else None
        if event is not None:
            self._transactions.apply_step(session, self._core.step(state, event, self._clock.now()))

    def _wake_later(self) -> None:
        if not self._timing:
            self._timing = True
            asyncio.get_running_loop().call_later(WITHIN_S, self._schedule, self._publish_old)

    def _publish_old(self) -> None:
        self._timing = False
        now = asyncio.get_running_loop().time()
        for session in [s for s, since in self._since.items() if now - since >= WITHIN_S]:
            self._publish(session)
        if self._since:
            self._wake_later()
