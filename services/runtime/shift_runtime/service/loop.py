"""The worker: the shell that runs one service's core over bus and journal.

One loop takes whatever has arrived (facts of other services in their order, commands, the gaze
stream), steps the core, commits everything in one transaction and only then publishes and replies.
Where there is nothing to publish and nothing to reply, the commit can wait for the next: until then the
owners have what was read. It knows nothing of what the core does.
"""

from __future__ import annotations

import asyncio
import json
from collections import deque
from collections.abc import Callable, Coroutine, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Generic, Protocol, TypeVar

import structlog
from shift_schemas.codec import decode, encode, encode_answer, encoding_of
from shift_schemas.conflicts import repeat_conflict
from shift_schemas.core_protocol import InputsMissing, Step
from shift_schemas.errors import MalformedMessage, Problem, ShiftError, Unavailable, UnknownThing
from shift_schemas.keys import (
    PROCEDURES,
    ROOT,
    STREAMS,
    CommandKey,
    FactKey,
    ServiceKey,
    StreamKey,
    build_key,
    parse_key,
)
from shift_schemas.lifecycle import has_ended
from shift_schemas.messages import (
    COMMANDS,
    FACTS,
    Command,
    Fact,
    GazeChunk,
    Health,
    OutboxQuery,
    OutboxRow,
    Session,
)
from shift_schemas.timestamps import Stamp

from shift_runtime.bus.protocol import Bus, Incoming, Request
from shift_runtime.claim import Claim
from shift_runtime.clock import Clock
from shift_runtime.journal import AnswerKey, Batch, Journal, StoredAnswer, same_content
from shift_runtime.metrics import Metrics
from shift_runtime.reader import Reader, ReadFact

S = TypeVar("S")
log = structlog.get_logger()

BATCH = 256
HINT_WAIT_S = 0.05
"""How long a waiting command trusts that a hint will come before its owner's outbox is pulled."""
CHECK_EVERY_S = 1.0
"""How often a disk that refused is tried again; RELIABILITY.md, row 11, wants the alarm within as much."""
COMMIT_WITHIN_S = 0.25
"""How long what was read waits for a commit that something else needs; chosen: little to read again after a crash."""
HINT_AFTER_S = 0.002
"""How long after an answer its facts are published, unless a command waits for what follows from them. Measured on two
cores when it was chosen: a call over ROS 2 took 1.4 times the sum of its parts, 2.2 times with the hints first."""
STREAM_LIMIT = 5_000
"""Chunks that may wait; more are dropped and counted."""


class Recall(Protocol):
    """Finds facts of the session that the service itself put out, by its look-ups."""

    def __call__(self, subject: str, **fields: str | int) -> list[Fact]:
        """Return them, oldest first."""


class CoreStep(Protocol[S]):
    """A core's fold."""

    def __call__(self, state: S | None, message: Any, now: Stamp, /, timed_out: bool = False) -> Step[S]: ...


@dataclass(frozen=True)
class Core(Generic[S]):
    """A core, and what it takes in: the owners that it reads and which of their subjects it steps on."""

    name: str
    step: CoreStep[S]
    dump: Callable[[S], str]
    load: Callable[[str], S]
    reads: Mapping[str, frozenset[str]]
    prepare: Callable[[Any, Recall], Any] = lambda message, recall: message
    """What a command or a chunk is stepped as, given what was recorded before."""
    lookups: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """By subject of its own, the fields by which ``recall`` finds facts."""


@dataclass
class Asked:
    """A command or a chunk that waits for its answer. Repeats of it that arrive meanwhile wait along."""

    session: str
    procedure: str
    message: Command | GazeChunk
    requests: list[Request]
    deadline: float | None = None
    timed_out: bool = False
    checked: bool = False
    """Whether the owners were asked again before something is called unknown."""

    @property
    def key(self) -> AnswerKey | None:
        """Under which its answer is kept; the stream's chunks have their own numbers."""
        if isinstance(self.message, Command):
            return (self.session, self.procedure, self.message.command_id)
        return None

    def refuse(self, error: ShiftError) -> None:
        """Answer all who wait with an error."""
        payload = encode(Problem.of(error))
        for request in self.requests:
            request.refuse(payload)
        self.requests.clear()


@dataclass(frozen=True)
class _Told:
    """An answer to be: its result as JSON, and the owner's sequence with the effects of it."""

    result: str
    seq: int
    repeat: bool = False


@dataclass
class _Turn:
    """What the loop did since the last commit, and who is to be told of it."""

    batch: Batch = field(default_factory=Batch)
    before: dict[str, Any] = field(default_factory=dict)
    facts: list[tuple[OutboxRow, Fact]] = field(default_factory=list)
    answers: list[tuple[Asked, _Told]] = field(default_factory=list)
    refusals: list[tuple[Asked, ShiftError]] = field(default_factory=list)
    ended: set[str] = field(default_factory=set)


class Worker(Generic[S]):
    """Runs ``core``. :meth:`run` returns when :meth:`stop` was called."""

    def __init__(self, core: Core[S], bus: Bus, journal: Journal, clock: Clock, metrics: Metrics) -> None:
        self.core = core
        self.bus = bus
        self.journal = journal
        self.clock = clock
        self.metrics = metrics
        self.states: dict[str, S | None] = {}
        self.reader = Reader(
            bus, tuple(core.reads), journal.cursors(), self._deliver, metrics.dropped, done=self._closed_sessions(),
            lost=metrics.link_lost,
        )  # fmt: skip
        self.claim = Claim(bus, core.name, journal.mesh, clock.now())
        self.processed = dict(self.reader.cursors)
        self._queue: deque[ReadFact | Asked | Callable[[], None]] = deque()
        self._waiting: dict[str, list[Asked]] = {}
        self._wake = asyncio.Event()
        self._stopping = False
        self._alarm = ""
        self._checking = False
        self._overload = 0
        self._tasks: set[asyncio.Task[None]] = set()
        self._hints: list[tuple[OutboxRow, Fact]] = []
        self._open = _Turn()
        self._due = False
        """Whether what waits for a commit has waited long enough."""
        self._timing = False

    # --- life ---

    async def run(self) -> None:
        """Declare the doors, read the journals, and work until :meth:`stop`.

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
            await self.on_start()
            while not self._stopping:
                await self._turn()
            await self.on_stop()
            self._settle()
            self._commit(self._open)
            self._publish_hints()
            if claiming.done():
                claiming.result()
        finally:
            pulling.cancel()
            claiming.cancel()

    def stop(self) -> None:
        """Finish the turn and return from :meth:`run`."""
        self._stopping = True
        self._wake.set()

    async def on_start(self) -> None:
        """A place for a service's own preparations."""

    async def on_stop(self) -> None:
        """A place for a service's own tidying."""

    def prepare(self, session: str, message: Command | GazeChunk) -> Any:
        """A place for what a command needs of the world before the pure core can carry it out."""
        return self.core.prepare(message, partial(self._recall, session))

    def _recall(self, session: str, subject: str, **fields: str | int) -> list[Fact]:
        kept = [decode(FACTS[subject], text) for text in self.journal.recorded(session, subject, fields)]
        of_this_turn = [
            fact
            for row, fact in self._open.facts
            if (row.session, row.subject) == (session, subject)
            and all(getattr(fact, name) == value for name, value in fields.items())
        ]
        return [*kept, *of_this_turn]

    @property
    def ready(self) -> bool:
        """Whether every owner's journal was read and the disk takes commits."""
        return not self._alarm and self.reader.synced >= set(self.core.reads)

    def _closed_sessions(self) -> set[str]:
        return {s for s, closed in self.journal.sessions() if closed}

    def _declare(self) -> None:
        name = self.core.name
        self.bus.serve(build_key(ServiceKey(name, "outbox")), self._on_outbox)
        self.bus.serve(build_key(ServiceKey(name, "health")), self._on_health)
        self.bus.serve(build_key(ServiceKey(name, "metrics")), self._on_metrics)
        for procedure in PROCEDURES.get(name, ()):
            self.bus.serve(f"{ROOT}/*/rpc/{procedure}", self._on_command)
        for stream, owner in STREAMS.items():
            if owner == name:
                self.bus.serve(f"{ROOT}/*/in/{stream}", self._on_stream_request, limit=STREAM_LIMIT)
                self.bus.subscribe(f"{ROOT}/*/in/{stream}", self._on_stream, limit=STREAM_LIMIT)
        self.bus.token(build_key(ServiceKey(name, "alive")))

    # --- arrivals; all in the loop ---

    def enqueue(self, item: ReadFact | Asked | Callable[[], None]) -> None:
        """Put something before the worker."""
        self._queue.append(item)
        self._wake.set()

    def _deliver(self, read: ReadFact) -> None:
        self.enqueue(read)

    def _on_outbox(self, request: Request) -> None:
        try:
            query = decode(OutboxQuery, request.payload)
        except MalformedMessage as e:
            self._drop(request, e)
            return
        request.reply(encode(self.journal.page(query, self.processed)))

    def _on_health(self, request: Request) -> None:
        self.enqueue(lambda: request.reply(encode(self.health())))

    def _on_metrics(self, request: Request) -> None:
        dropped = self.bus.dropped
        self.metrics.dropped("overload", dropped - self._overload)
        self._overload = dropped
        self.metrics.sessions(len(self.states))
        for owner in self.reader.owners:
            self.metrics.silent(owner, self.reader.links.silent_s(owner))
        request.reply(self.metrics.text())

    def health(self) -> Health:
        """This worker's own answer."""
        missing = sorted(set(self.core.reads) - self.reader.synced)
        unreached = self.reader.links.unreached
        reasons = [
            self._alarm,
            f"waits for the {', the '.join(missing)}" if missing else "",
            f"the {self.core.name} does not reach the {', the '.join(unreached)}" if unreached else "",
            self.claim.conflict,
            next(iter(self.reader.misfits.values()), ""),
        ]
        return Health(
            service=self.core.name, ready=self.ready and not any(reasons), detail=next(filter(None, reasons), ""),
            sessions=len(self.states), unreached=unreached, mesh=self.claim.mesh, since=self.claim.since,
            data=str(self.journal.path.parent.parent.absolute()),
        )  # fmt: skip

    def _on_command(self, request: Request) -> None:
        try:
            key = parse_key(request.key)
            if not isinstance(key, CommandKey):
                raise MalformedMessage(f"{request.key} is not the key of a command")
            command = decode(COMMANDS[key.procedure], request.payload)
            if command.session != key.session:
                raise MalformedMessage(f"a command for session {command.session} under session {key.session}")
        except MalformedMessage as e:
            self._drop(request, e)
            return
        self._ask(key.session, key.procedure, command, [request])

    def _on_stream_request(self, request: Request) -> None:
        try:
            session, chunk = self._chunk(request.key, request.payload)
        except MalformedMessage as e:
            self._drop(request, e)
            return
        self._ask(session, "gaze", chunk, [request])

    def _on_stream(self, incoming: Incoming) -> None:
        try:
            session, chunk = self._chunk(incoming.key, incoming.payload)
        except MalformedMessage:
            self.metrics.dropped("malformed")
            return
        self._ask(session, "gaze", chunk, [])

    def _chunk(self, text: str, payload: bytes) -> tuple[str, GazeChunk]:
        key = parse_key(text)
        if not isinstance(key, StreamKey):
            raise MalformedMessage(f"{text} is not the key of a stream")
        return key.session, decode(GazeChunk, payload)

    def _drop(self, request: Request, error: MalformedMessage) -> None:
        self.metrics.dropped("malformed")
        request.refuse(encode(Problem.of(error)))

    def _ask(self, session: str, procedure: str, message: Command | GazeChunk, requests: list[Request]) -> None:
        asked = Asked(session, procedure, message, requests)
        if asked.key is not None:
            for waiting in self._waiting.get(session, ()):
                if waiting.key == asked.key and waiting.message == message:
                    waiting.requests += requests
                    return
        self.enqueue(asked)

    # --- the turn ---

    async def _turn(self) -> None:
        if not self._queue:
            self._wake.clear()
            await self._wake.wait()
        turn = self._open
        touched: set[str] = set()
        for _ in range(BATCH):
            if not self._queue:
                break
            item = self._queue.popleft()
            if isinstance(item, ReadFact):
                self._apply(turn, item)
                touched.add(item.fact.session)
            elif isinstance(item, Asked):
                self._answer(turn, item)
            else:
                item()
        for session in touched:
            for asked in self._waiting.pop(session, []):
                self._answer(turn, asked)
        self._commit(turn)
        await asyncio.sleep(0)

    def _apply(self, turn: _Turn, read: ReadFact) -> None:
        session = read.fact.session
        if read.seq != self.processed.get((session, read.owner), 0) + 1:
            return  # a commit failed meanwhile: this one is read again in its turn
        state = self._state(session)
        if read.fact.subject in self.core.reads[read.owner]:
            try:
                step = self.core.step(state, read.fact, self.clock.now())
            except (InputsMissing, UnknownThing, Unavailable):
                self._hold_back(session, read)
                return
            self._take(turn, session, step)
            self.metrics.read(read.fact.subject)
        elif state is None:
            self._hold_back(session, read)
            return
        self.processed[session, read.owner] = read.seq
        turn.batch.cursors[session, read.owner] = read.seq
        if isinstance(read.fact, Session) and has_ended(read.fact.state):
            turn.ended.add(session)

    def _hold_back(self, session: str, read: ReadFact) -> None:
        """Its session or configuration has not been read yet: this fact is read again after it."""
        self.reader.cursors[session, read.owner] = read.seq - 1

        async def in_turn() -> None:
            if await self.reader.pull("recorder"):
                await asyncio.sleep(HINT_WAIT_S)
                await self.reader.pull(read.owner)

        self._background(in_turn())

    def _background(self, work: Coroutine[Any, Any, None]) -> None:
        task = asyncio.get_running_loop().create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def _answer(self, turn: _Turn, asked: Asked) -> None:
        """Carry out a command once; what it gives is told after the commit."""
        try:
            found = self._first_result(turn, asked)
            if found is not None:
                turn.answers.append((asked, _Told(found, self._head(turn, asked.session), repeat=True)))
                return
            message = self.prepare(asked.session, asked.message)
            step = self.core.step(self._state(asked.session), message, self.clock.now(), timed_out=asked.timed_out)
        except InputsMissing as e:
            self._wait(asked, e)
        except UnknownThing as e:
            self._unknown(turn, asked, e)
        except ShiftError as e:
            self._refuse(turn, asked, e)
        except Exception as e:  # a mistake of ours: it must not end the service for everybody else
            log.exception("a command failed", procedure=asked.procedure, session=asked.session)
            why = f"because of a mistake of its own ({type(e).__name__}); see its log"
            self._refuse(turn, asked, ShiftError(f"the {self.core.name} could not do this {why}"))
        else:
            self._take(turn, asked.session, step)
            self._keep(turn, asked, step)

    def _first_result(self, turn: _Turn, asked: Asked) -> str | None:
        if asked.key is None or not isinstance(asked.message, Command):
            return None
        stored = turn.batch.answers.get(asked.key) or self.journal.answer(asked.key)
        if stored is None:
            return None
        if not same_content(stored.content, asked.message.content()):
            raise repeat_conflict(asked.message, stored.content)
        return stored.result

    def _keep(self, turn: _Turn, asked: Asked, step: Step[S]) -> None:
        if isinstance(step.result, Fact):
            row = next(row for row, fact in turn.facts if fact is step.result)
            result, seq = row.payload, row.seq
        else:
            result, seq = json.dumps(step.result), 0
        if asked.key is not None and isinstance(asked.message, Command):
            turn.batch.answers[asked.key] = StoredAnswer(asked.message.content(), result, seq)
        turn.answers.append((asked, _Told(result, self._head(turn, asked.session), step.repeat)))

    def _refuse(self, turn: _Turn, asked: Asked, error: ShiftError) -> None:
        turn.refusals.append((asked, error))

    def _take(self, turn: _Turn, session: str, step: Step[S]) -> None:
        turn.before.setdefault(session, self.states.get(session))
        self.states[session] = step.state
        turn.batch.states[session] = ""
        for fact in step.facts:
            row = OutboxRow(
                session=session,
                seq=self._head(turn, session) + 1,
                subject=fact.subject,
                payload=fact.model_dump_json(),
            )
            turn.batch.rows.append(row)
            turn.facts.append((row, fact))

    def _head(self, turn: _Turn, session: str) -> int:
        for row in reversed(turn.batch.rows):
            if row.session == session:
                return row.seq
        return self.journal.heads.get(session, 0)

    def _state(self, session: str) -> S | None:
        if session not in self.states:
            text = self.journal.state(session)
            if text is None:
                return None
            self.states[session] = self.core.load(text)
        return self.states[session]

    # --- waiting ---

    def _wait(self, asked: Asked, not_yet: InputsMissing) -> None:
        self._publish_hints()  # what it waits for may follow from them
        loop = asyncio.get_running_loop()
        if asked.deadline is None:
            asked.deadline = loop.time() + not_yet.give_up_s
            loop.call_later(not_yet.give_up_s, self._give_up, asked)
            loop.call_later(min(HINT_WAIT_S, not_yet.give_up_s / 2), self._pull_for, asked, not_yet.owners)
        self._waiting.setdefault(asked.session, []).append(asked)

    def _pull_for(self, asked: Asked, owners: tuple[str, ...]) -> None:
        if asked in self._waiting.get(asked.session, ()):
            for owner in owners:
                if owner in self.reader.owners:
                    self.reader.pull_soon(owner)
            asyncio.get_running_loop().call_later(4 * HINT_WAIT_S, self._pull_for, asked, owners)

    def _give_up(self, asked: Asked) -> None:
        waiting = self._waiting.get(asked.session, [])
        if asked in waiting:
            waiting.remove(asked)
            asked.timed_out = True
            self.enqueue(asked)

    def _unknown(self, turn: _Turn, asked: Asked, error: UnknownThing) -> None:
        """Before something is called unknown, the owners are asked once more; without them nobody knows.

        Nor does a service whose disk refuses: it cannot keep what they tell it.
        """
        if self._alarm:
            self._refuse(turn, asked, Unavailable(self._alarm))
            return
        if asked.checked or not self.reader.owners:
            self._refuse(turn, asked, error)
            return
        asked.checked = True

        async def ask_again() -> None:
            silent = await self.reader.pull_all(self.reader.owners)
            if silent and "recorder" in silent:
                asked.refuse(Unavailable(f"the {self.core.name} cannot know yet: the {silent[0]} does not answer"))
                return
            self.enqueue(asked)

        self._background(ask_again())

    # --- the end of a turn ---

    def _commit(self, turn: _Turn) -> None:
        turn.batch.closed |= turn.ended
        if not self._must_commit(turn):
            self._open = _Turn(turn.batch, turn.before)
            self._commit_later()
            self._tell(turn)
            return
        self._open, self._due = _Turn(), False
        for session in turn.batch.states:
            state = self.states[session]
            assert state is not None
            turn.batch.states[session] = self.core.dump(state)
        try:
            with self.metrics.commit_seconds.time():
                self.journal.commit(turn.batch)
        except Unavailable as e:
            self._undo(turn, e)
            return
        self._relieved()
        self._tell(turn)

    def _must_commit(self, turn: _Turn) -> bool:
        """What was read can wait a while; cursors alone can wait for good: what they passed over changed nothing."""
        batch = turn.batch
        told = any(not told.repeat for _, told in turn.answers)
        return bool(batch.rows or batch.answers or batch.closed or told or (self._due and batch.states))

    def _commit_later(self) -> None:
        if self._open.batch.states and not self._timing:
            self._timing = True
            asyncio.get_running_loop().call_later(COMMIT_WITHIN_S, self.enqueue, self._settle)

    def _settle(self) -> None:
        self._timing, self._due = False, True

    def _tell(self, turn: _Turn) -> None:
        """Answers first: a hint wakes every other service, and on few cores they would race the answer home."""
        for asked, told in turn.answers:
            payload = encode_answer(self.core.name, told.seq, told.repeat, told.result)
            for request in asked.requests:
                request.reply(payload)
            self.metrics.answered(asked.procedure, "repeat" if told.repeat else "done")
        for asked, error in turn.refusals:
            self.metrics.answered(asked.procedure, error.kind)
            if not asked.requests:
                self.metrics.dropped("refused")
            asked.refuse(error)
        self._hint(turn.facts, later=any(asked.requests for asked, _ in turn.answers))
        for session in turn.ended:
            self.states.pop(session, None)
            self.reader.forget(session)
        self.after_turn()

    def _hint(self, facts: list[tuple[OutboxRow, Fact]], later: bool) -> None:
        """Publish committed facts in their order; those that go with an answer a little after it."""
        waiting = bool(self._hints)
        self._hints += facts
        if later and not waiting:
            asyncio.get_running_loop().call_later(HINT_AFTER_S, self._publish_hints)
        elif not waiting:
            self._publish_hints()

    def _publish_hints(self) -> None:
        hints, self._hints = self._hints, []
        for row, fact in hints:
            self.publish(row, fact)

    def after_turn(self) -> None:
        """A place for what a service does once a turn is committed."""

    def publish(self, row: OutboxRow, fact: Fact) -> None:
        """Put a committed fact on the bus, as a hint."""
        self.metrics.published(row.subject)
        self.bus.put(
            build_key(FactKey(row.session, row.subject)),
            row.payload.encode(),
            encoding=encoding_of(FACTS[row.subject]),
            attachment=str(row.seq).encode(),
        )

    def _undo(self, turn: _Turn, error: Unavailable) -> None:
        """Nothing of the turn happened: states go back, inputs are read again, askers are told."""
        self._alarm = error.detail
        self._check_later()
        self.metrics.commit_failed()
        log.error("commit failed", error=error.detail)
        for session, state in turn.before.items():
            if state is None:
                self.states.pop(session, None)
            else:
                self.states[session] = state
        committed = self.journal.cursors()
        for key in turn.batch.cursors:
            self.reader.cursors[key] = self.processed[key] = committed.get(key, 0)
        for asked, _ in turn.answers:
            asked.refuse(error)
        for asked, refused in turn.refusals:
            asked.refuse(refused)

    def _check_later(self) -> None:
        """Nobody may ask anything more while the alarm is up: so the disk is tried now and then."""
        if not self._checking:
            self._checking = True
            asyncio.get_running_loop().call_later(CHECK_EVERY_S, self.enqueue, self._check)

    def _check(self) -> None:
        self._checking = False
        if not self._alarm:
            return
        try:
            self.journal.check()
        except Unavailable as e:
            self._alarm = e.detail
            self._check_later()
        else:
            self._relieved()

    def _relieved(self) -> None:
        if self._alarm:
            log.warning("the disk takes commits again")
        self._alarm = ""
