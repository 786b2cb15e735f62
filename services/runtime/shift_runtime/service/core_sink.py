"""The sink of a service that steps its core on the facts of others."""

from __future__ import annotations

from typing import Generic, TypeVar

from shift_schemas.core_protocol import InputsMissing
from shift_schemas.errors import Unavailable, UnknownThing
from shift_schemas.lifecycle import has_ended
from shift_schemas.messages import Session

from shift_runtime.clock import Clock
from shift_runtime.metrics import Metrics
from shift_runtime.reader import ReadFact
from shift_runtime.service.core import Core
from shift_runtime.service.progress import Progress
from shift_runtime.service.states import SessionStates
from shift_runtime.service.transaction import Transactions
from shift_runtime.service.waiting import Waiting

S = TypeVar("S")


class CoreSink(Generic[S]):
    """Steps the core on each fact, in its owner's order. A fact that came before its session is deferred."""

    def __init__(
        self,
        core: Core[S],
        states: SessionStates[S],
        progress: Progress,
        transactions: Transactions[S],
        waiting: Waiting,
        clock: Clock,
        metrics: Metrics,
    ) -> None:
        self._core = core
        self._states = states
        self._progress = progress
        self._transactions = transactions
        self._waiting = waiting
        self._clock = clock
        self._metrics = metrics

    def apply(self, read: ReadFact) -> None:
        """Step the core on a fact, or defer it until its session and its configuration have been read."""
        if not self._progress.is_next(read):
            return
        fact = read.fact
        state = self._states.get(fact.session)
        if fact.subject in self._core.reads[read.owner]:
            try:
                step = self._core.step(state, fact, self._clock.now())
            except (InputsMissing, UnknownThing, Unavailable):
                self._defer(read)
                return
            self._transactions.apply_step(fact.session, step)
            self._metrics.read(fact.subject)
        elif state is None:
            self._defer(read)
            return
        self._transactions.mark_read(read)
        if isinstance(fact, Session) and has_ended(fact.state):
            self._transactions.close_session(fact.session)

    def _defer(self, read: ReadFact) -> None:
        self._progress.put_back(read)
        self._waiting.read_again(read.owner)
