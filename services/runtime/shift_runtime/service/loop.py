"""The worker: the shell that runs one service's core over bus and journal.

One loop takes whatever has arrived (facts of other services in their order, commands, stream chunks), steps the core,
commits everything in one transaction, and only then replies and publishes. The parts are classes of their own, which
this module puts together:

=====================  ====================================================================================
``requests``           decoding of commands and chunks; equal commands get one answer
``waiting``            requests that wait for their inputs, and what is pulled for them
``transaction``        commit, deferred commit, undo
``notifications``      when and in which order committed facts are published
``held_back``          what the core holds back until somebody asks for it
``extension``          what a service adds: the sink of the facts of others, the protocol of ends in two halves
=====================  ====================================================================================
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable
from functools import partial
from typing import Any, Generic, TypeVar

import structlog
from shift_schemas.codec import encode_answer
from shift_schemas.core_protocol import InputsMissing, Step
from shift_schemas.errors import ShiftError, Unavailable, UnknownThing
from shift_schemas.keys import ServiceKey, build_key

from shift_runtime.bus.protocol import Bus
from shift_runtime.claim import Claim
from shift_runtime.clock import Clock
from shift_runtime.journal import Journal
from shift_runtime.metrics import Metrics
from shift_runtime.reader import Reader, ReadFact
from shift_runtime.service.background import BackgroundTasks
from shift_runtime.service.core import Core
from shift_runtime.service.core_sink import CoreSink
from shift_runtime.service.disk_alarm import DiskAlarm
from shift_runtime.service.endpoints import ServiceEndpoints
from shift_runtime.service.extension import Extension, NoEndProtocol
from shift_runtime.service.held_back import HeldBack
from shift_runtime.service.notifications import Notifications
from shift_runtime.service.progress import Progress
from shift_runtime.service.requests import PendingRequest, Requests
from shift_runtime.service.states import SessionStates
from shift_runtime.service.transaction import Transaction, Transactions
from shift_runtime.service.waiting import Waiting

S = TypeVar("S")
Item = ReadFact | PendingRequest | Callable[[], None]
log = structlog.get_logger()

BATCH = 256
"""How many arrivals one turn takes at most; chosen: a commit is shared by many and a reply still comes soon."""


class Worker(Generic[S]):
    """Runs ``core``, extended by what ``extend`` returns for this worker.

    :meth:`run` returns after :meth:`stop` was called.
    """

    def __init__(
        self,
        core: Core[S],
        bus: Bus,
        journal: Journal,
        clock: Clock,
        metrics: Metrics,
        extend: Callable[[Worker[S]], Extension] | None = None,
    ) -> None:
        self.core = core
        self.bus = bus
        self.journal = journal
        self.clock = clock
        self.metrics = metrics
        self.tasks = BackgroundTasks()
        self.states = SessionStates(core, journal)
        self.reader = Reader(
            bus, tuple(core.reads), journal.cursors(), self.enqueue, metrics.dropped,
            done={s for s, closed in journal.sessions() if closed}, lost=metrics.link_lost,
        )  # fmt: skip
        self.progress = Progress(self.reader, journal)
        self.claim = Claim(bus, core.name, journal.mesh, clock.now())
        self.alarm = DiskAlarm(journal.check, self.enqueue)
        self.transactions = Transactions(journal, self.states, self.progress, self.alarm, metrics, self.enqueue)
        self.waiting = Waiting(core.name, self.reader, self.tasks, self.enqueue)
        self.requests = Requests(core.name, bus, journal, metrics, self.waiting.join, self.enqueue)
        self.notifications = Notifications(bus, metrics)
        self.held_back = HeldBack(core, self.states, self.transactions, clock, self.enqueue)
        self.endpoints = ServiceEndpoints(
            core.name, bus, journal, metrics, self.reader, self.progress, self.claim, self.alarm, self.states,
            self.enqueue, self.held_back.publish_for,
        )  # fmt: skip
        self._queue: deque[Item] = deque()
        self._wake = asyncio.Event()
        self._stopping = False
        self._extension = extend(self) if extend is not None else self._plain()

    def _plain(self) -> Extension:
        sink = CoreSink(
            self.core, self.states, self.progress, self.transactions, self.waiting, self.clock, self.metrics
        )
        return Extension(sink, NoEndProtocol(), self._prepare)

    def _prepare(self, session: str, message: Any) -> Any:
        return self.core.prepare(self.states.get(session), message, partial(self.transactions.recall, session))

    # --- life ---

    async def run(self) -> None:
        """Answer requests, read the journals, and work until :meth:`stop`.

        Raises
        ------
        OwnedElsewhere
            Another mesh answers under this service's keys, and was there before.
        """
        await self.claim.make()
        self._declare()
        self.reader.start()
        pulling = asyncio.create_task(self.reader.run())
        claiming = asyncio.create_task(self.claim.keep())
        claiming.add_done_callback(lambda task: self.stop())
        try:
            await self._extension.start()
            while not self._stopping:
                await self._wait_for_arrivals()
                await self._turn()
            await self._extension.stop()
            self._finish()
            if claiming.done():
                claiming.result()
        finally:
            pulling.cancel()
            claiming.cancel()

    def stop(self) -> None:
        """Finish the turn and return from :meth:`run`."""
        self._stopping = True
        self._wake.set()

    async def work_off(self) -> None:
        """Process everything that has arrived."""
        while self._queue:
            await self._turn()

    @property
    def ready(self) -> bool:
        """Whether every owner's journal was read and the disk takes commits."""
        return self.endpoints.ready

    def _declare(self) -> None:
        self.endpoints.declare()
        self.requests.declare()
        self.bus.token(build_key(ServiceKey(self.core.name, "alive")))

    def _finish(self) -> None:
        self.transactions.force_commit()
        self._commit()
        self.notifications.flush()

    # --- the turn ---

    def enqueue(self, item: Item) -> None:
        """Put a fact, a request or a function before the worker."""
        self._queue.append(item)
        self._wake.set()

    async def _wait_for_arrivals(self) -> None:
        if not self._queue:
            self._wake.clear()
            await self._wake.wait()

    async def _turn(self) -> None:
        touched: set[str] = set()
        for _ in range(BATCH):
            if not self._queue:
                break
            item = self._queue.popleft()
            if isinstance(item, ReadFact):
                self._extension.sink.apply(item)
                touched.add(item.fact.session)
            elif isinstance(item, PendingRequest):
                self._answer(item)
            else:
                item()
        for session in touched:
            for request in self.waiting.release(session):
                self._answer(request)
        self._commit()
        self.held_back.after_commit()
        await asyncio.sleep(0)

    def _answer(self, request: PendingRequest) -> None:
        """Carry out a request once; its reply is sent after the commit."""
        try:
            if self._extension.ends.takes(request):
                self.transactions.apply_step(request.session, self._step(request, request.message))
                self._extension.ends.wait(request)
                return
            earlier = self.requests.earlier_result(request, self.transactions.open.batch.answers)
            if earlier is not None:
                self.transactions.reply(request, earlier, repeat=True)
                return
            step = self._step(request, self._extension.prepare(request.session, request.message))
        except InputsMissing as e:
            self.notifications.flush()  # what the request waits for may follow from them
            self.waiting.park(request, e)
        except UnknownThing as e:
            self._answer_unknown(request, e)
        except ShiftError as e:
            self._count_refusal(request, e)
            self.transactions.refuse(request, e)
        except Exception as e:  # a mistake in this service must not end it for everybody else
            log.exception("a command failed", procedure=request.procedure, session=request.session)
            why = f"because of a mistake of its own ({type(e).__name__}); see its log"
            self.transactions.refuse(request, ShiftError(f"the {self.core.name} could not do this {why}"))
        else:
            self.transactions.apply_step(request.session, step)
            self.transactions.store_answer(request, step)
            self.held_back.note(request.session, step.state)

    def _count_refusal(self, request: PendingRequest, error: ShiftError) -> None:
        """Let the core count a refusal; this is committed like input without a visible effect."""
        state = self.states.get(request.session)
        if self.core.refused is not None and state is not None:
            after = self.core.refused(state, request.message, error)
            if after is not state:
                self.transactions.apply_step(request.session, Step(after))

    def _step(self, request: PendingRequest, message: Any) -> Step[S]:
        return self.core.step(self.states.get(request.session), message, self.clock.now(), timed_out=request.timed_out)

    def _answer_unknown(self, request: PendingRequest, error: UnknownThing) -> None:
        """Refuse a request about something unknown, after the owners were asked once more.

        A service whose disk refuses cannot keep what the owners answer, so it does not know either.
        """
        if self.alarm.detail:
            self.transactions.refuse(request, Unavailable(self.alarm.detail))
        elif request.checked or not self.reader.owners:
            self.transactions.refuse(request, error)
        else:
            self.waiting.resume_after_check(request)

    # --- the end of a turn ---

    def _commit(self) -> None:
        done = self.transactions.commit()
        if done is not None:
            self.reply(done)

    def reply(self, done: Transaction) -> None:
        """Send the replies of a transaction, publish its facts and forget the sessions that it closed.

        The replies go first, because a notification wakes every other service.
        """
        for pending in done.replies:
            request = pending.request
            request.reply(encode_answer(self.core.name, pending.seq, pending.repeat, pending.result))
            self.metrics.answered(request.procedure, "repeat" if pending.repeat else "done")
        for request, error in done.refusals:
            self.metrics.answered(request.procedure, error.kind)
            if not request.requests:
                self.metrics.dropped("refused")
            request.refuse(error)
        asked = any(pending.request.requests for pending in done.replies)
        self.notifications.notify([row for row, _ in done.facts], later=asked)
        for session in done.batch.closed:
            self.states.unload(session)
            self.reader.forget(session)
        self._extension.ends.after_commit()
