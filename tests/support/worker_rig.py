"""A worker in one process with the tester: a core small enough to check by hand, owners to read, a full disk."""

from __future__ import annotations

import asyncio
import itertools
import json
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from shift_runtime.bus.memory import Hub, MemoryBus
from shift_runtime.bus.protocol import Bus, Handle, Incoming, Reply, Request
from shift_runtime.clock import ManualClock
from shift_runtime.journal import Batch, Journal
from shift_runtime.metrics import Metrics
from shift_runtime.service.core import Core
from shift_runtime.service.loop import Worker
from shift_schemas.codec import decode, encode
from shift_schemas.core_protocol import InputsMissing, Step
from shift_schemas.errors import Problem, Unavailable, UnknownThing
from shift_schemas.keys import CommandKey, FactKey, ServiceKey, build_key
from shift_schemas.messages import (
    Answer,
    Config,
    Decide,
    Fact,
    Fixation,
    Health,
    OutboxPage,
    OutboxQuery,
    OutboxRow,
    Override,
    Seen,
    Session,
)
from shift_schemas.timestamps import Stamp

from support.runtime_fixtures import until

WAIT_S = 0.15


@dataclass(frozen=True)
class Notes:
    """What the core below did, in its order."""

    session: str
    config: int = 0
    notes: tuple[str, ...] = ()

    @property
    def fixations(self) -> int:
        return sum(note.startswith("fixation") for note in self.notes)


def step(state: Notes | None, message: Any, now: Stamp, timed_out: bool = False) -> Step[Notes]:
    """Notes each fixation and each decision, and puts each note out as an override.

    A task ``after-3`` waits for three fixations, ``unknown`` is known after the first, ``breaks`` breaks.
    """
    if isinstance(message, Session):
        return Step(state or Notes(message.session))
    if state is None:
        raise UnknownThing("there is no such session")
    match message:
        case Config():
            return Step(replace(state, config=message.version))
        case Fixation():
            if not state.config:
                raise InputsMissing(("recorder",), WAIT_S)
            return noted(state, f"fixation {message.start_s:.0f}", f"f{message.start_s:.0f}", now)
        case Decide(task="breaks"):
            raise ZeroDivisionError
        case Decide(task="unknown") if not state.fixations:
            raise UnknownThing("there is no task unknown")
        case Decide() if message.task.startswith("after-") and not timed_out:
            if state.fixations < int(message.task.removeprefix("after-")):
                raise InputsMissing(("monitor",), WAIT_S)
        case Decide(task="fact"):
            done = noted(state, f"decision {message.command_id}", message.command_id, now)
            return replace(done, result=done.facts[0])
    assert isinstance(message, Decide)
    done = noted(state, f"decision {message.command_id}", message.command_id, now)
    return replace(done, result={"n": len(done.state.notes), "fixations": state.fixations, "timed_out": timed_out})


def noted(state: Notes, note: str, note_id: str, now: Stamp) -> Step[Notes]:
    fact = Override(session=state.session, stamp=now, override_id=note_id, task="any", strategy={}, reason=note)
    return Step(replace(state, notes=(*state.notes, note)), (fact,))


def dump(state: Notes) -> str:
    return json.dumps([state.session, state.config, state.notes])


def load(text: str) -> Notes:
    session, config, notes = json.loads(text)
    return Notes(session, config, tuple(notes))


READS = {"recorder": frozenset({"session", "config"}), "monitor": frozenset({"fixation"})}
CORE: Core[Notes] = Core("decider", step, dump, load, READS)


# --- those that it reads ---


def session(name: str = "s1", state: Any = "live") -> Session:
    return Session(
        session=name, stamp=Stamp.of(1), participant="P1", study="default", seed=1, state=state, started=Stamp.of(1)
    )


def config(name: str = "s1", version: int = 1) -> Config:
    return Config(session=name, stamp=Stamp.of(1), version=version, study="{}")


def fixation(n: int, name: str = "s1") -> Fixation:
    return Fixation(
        session=name, stamp=Stamp.of(n), source="eyes", start_s=float(n), duration_s=0.1, x=0.5, y=0.5, aoi=""
    )


@dataclass
class Owner:
    """Somebody else's journal."""

    bus: Bus
    name: str
    rows: dict[str, list[OutboxRow]] = field(default_factory=dict)
    asked: int = 0
    _served: Handle | None = None

    def live(self) -> Owner:
        self._served = self.bus.serve(build_key(ServiceKey(self.name, "outbox")), self._page)
        return self

    def die(self) -> None:
        assert self._served is not None
        self._served.close()

    def put_out(self, *facts: Fact, hint: bool = True) -> None:
        for fact in facts:
            rows = self.rows.setdefault(fact.session, [])
            payload = fact.model_dump_json()
            rows.append(OutboxRow(session=fact.session, seq=len(rows) + 1, subject=fact.subject, payload=payload))
            if hint:
                key = build_key(FactKey(fact.session, fact.subject))
                self.bus.put(key, payload.encode(), attachment=str(len(rows)).encode())

    def _page(self, request: Request) -> None:
        self.asked += 1
        query = decode(OutboxQuery, request.payload)
        wanted = self.rows if query.only is None else {s: self.rows.get(s, []) for s in query.only}
        rows = list(itertools.chain.from_iterable(found[query.cursors.get(s, 0) :] for s, found in wanted.items()))
        heads = {s: len(found) for s, found in wanted.items()}
        request.reply(encode(OutboxPage(owner=self.name, rows=rows, heads=heads, complete=True)))


class FullDisk(Journal):
    """A journal whose disk can be full, and that counts its commits."""

    full = False
    commits = 0

    def commit(self, batch: Batch) -> None:
        if self.full:
            raise Unavailable("the decider cannot write its journal: the disk is full")
        self.commits += 1
        super().commit(batch)

    def check(self) -> None:
        if self.full:
            raise Unavailable("the decider cannot write its journal: the disk is full")
        super().check()


@dataclass
class Rig:
    """A worker under test, with its owners and a bus of the tester's."""

    path: Path
    hub: Hub = field(default_factory=Hub)
    published: list[Incoming] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.bus = MemoryBus(self.hub)
        self.recorder = Owner(self.bus, "recorder").live()
        self.monitor = Owner(self.bus, "monitor").live()
        self.bus.subscribe("shift/v1/*/override", self.published.append)

    def start(self) -> Worker[Notes]:
        """Begin a life of the worker."""
        self.journal = FullDisk(self.path, "decider")
        self.own_bus = MemoryBus(self.hub)
        self.worker = Worker(CORE, self.own_bus, self.journal, ManualClock(5), Metrics("decider"))
        self.running = asyncio.create_task(self.worker.run())
        return self.worker

    async def crash(self) -> None:
        """End it without another word, wherever it is; what was not committed is gone."""
        self.running.cancel()
        await asyncio.gather(self.running, return_exceptions=True)
        self.worker.tasks.cancel()
        await self.own_bus.close()
        self.journal.close()

    async def stop(self) -> None:
        self.worker.stop()
        await self.running
        await self.own_bus.close()
        self.journal.close()

    async def decide(
        self, command_id: str, task: str = "any", need: Seen | None = None, timeout_s: float = 5.0, name: str = "s1"
    ) -> Answer:
        """Ask; its answer, or its refusal raised."""
        command = Decide(command_id=command_id, session=name, task=task, need=need or Seen())
        (reply,) = await self.ask(build_key(CommandKey(name, "decide")), encode(command), timeout_s)
        if not reply.ok:
            raise decode(Problem, reply.payload).error()
        return decode(Answer, reply.payload)

    async def ask(self, key: str, payload: bytes, timeout_s: float = 5.0) -> list[Reply]:
        """The replies of who is there, once somebody is."""
        while not (replies := await self.bus.get(key, payload, timeout_s=timeout_s)):
            assert not self.running.done()
            await asyncio.sleep(0)
        return replies

    async def health(self) -> Health:
        (reply,) = await self.ask(build_key(ServiceKey("decider", "health")), b"")
        return decode(Health, reply.payload)

    async def ready(self) -> None:
        await until(lambda: self.worker.ready)

    async def dropped(self, reason: str) -> float:
        (reply,) = await self.ask(build_key(ServiceKey("decider", "metrics")), b"")
        wanted = f'shift_messages_dropped_total{{reason="{reason}",service="decider"}} '
        return next(
            float(line[len(wanted) :]) for line in reply.payload.decode().splitlines() if line.startswith(wanted)
        )

    def outbox(self, name: str = "s1") -> list[tuple[int, str]]:
        """What the worker committed: sequence and note."""
        rows = self.journal.page(OutboxQuery(only=[name], limit=10_000), {}).rows
        return [(row.seq, json.loads(row.payload)["reason"]) for row in rows]

    def committed(self, name: str = "s1") -> Notes:
        """The committed state."""
        text = self.journal.state(name)
        return load(text) if text else Notes(name)

    def notes(self, name: str = "s1") -> tuple[str, ...]:
        """The notes of the committed state."""
        return self.committed(name).notes

    def config(self) -> int:
        """The version of the configuration that the worker has read, committed or not."""
        state = self.worker.states.loaded("s1")
        return state.config if state else 0
