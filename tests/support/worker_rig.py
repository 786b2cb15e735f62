"""A worker in the test's process: a core that is small enough to check by hand, owners to read, and a full disk."""

from __future__ import annotations

import asyncio
import json
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from shift_runtime.bus.memory import Hub, MemoryBus
from shift_runtime.bus.protocol import Incoming, Reply
from shift_runtime.clock import ManualClock
from shift_runtime.journal import Batch, Journal
from shift_runtime.metrics import Metrics
from shift_runtime.service.core import Core
from shift_runtime.service.loop import Worker
from shift_schemas.codec import decode, encode
from shift_schemas.core_protocol import InputsMissing, Step
from shift_schemas.errors import Problem, Unavailable, UnknownThing
from shift_schemas.keys import CommandKey, ServiceKey, build_key
from shift_schemas.messages import (
    Answer,
    Config,
    Decide,
    Fixation,
    Health,
    OutboxQuery,
    Override,
    Seen,
    Session,
)
from shift_schemas.timestamps import Stamp

from support.outbox_owner import Owner
from support.runtime_fixtures import until

WAIT_S = 0.15


@dataclass(frozen=True)
class Notes:
    """The state of the core below: what it did, in order."""

    session: str
    config: int = 0
    notes: tuple[str, ...] = ()

    @property
    def fixations(self) -> int:
        return sum(note.startswith("fixation") for note in self.notes)


def step(state: Notes | None, message: Any, now: Stamp, timed_out: bool = False) -> Step[Notes]:
    """Note each fixation and each decision, and publish each note as an override.

    A task ``after-3`` waits for three fixations, ``unknown`` is known after the first one, and ``breaks`` raises.
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


# --- facts of the owners that it reads ---


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


class RunningWorker:
    """A worker that a test started, with its bus and its journal."""

    worker: Worker[Any]
    running: asyncio.Task[None]
    own_bus: MemoryBus
    journal: Journal

    async def crash(self) -> None:
        """End the worker at once; what was not committed is lost."""
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


@dataclass
class Rig(RunningWorker):
    """A worker under test, with its owners and the test's own bus."""

    path: Path
    hub: Hub = field(default_factory=Hub)
    published: list[Incoming] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.bus = MemoryBus(self.hub)
        self.recorder = Owner(self.bus, "recorder").live()
        self.monitor = Owner(self.bus, "monitor").live()
        self.bus.subscribe("shift/v1/*/override", self.published.append)

    def start(self) -> Worker[Notes]:
        """Start the worker."""
        self.journal = FullDisk(self.path, "decider")
        self.own_bus = MemoryBus(self.hub)
        self.worker = Worker(CORE, self.own_bus, self.journal, ManualClock(5), Metrics("decider"))
        self.running = asyncio.create_task(self.worker.run())
        return self.worker

    async def decide(
        self, command_id: str, task: str = "any", need: Seen | None = None, timeout_s: float = 5.0, name: str = "s1"
    ) -> Answer:
        """Return the worker's answer, or raise its refusal."""
        command = Decide(command_id=command_id, session=name, task=task, need=need or Seen())
        (reply,) = await self.ask(build_key(CommandKey(name, "decide")), encode(command), timeout_s)
        if not reply.ok:
            raise decode(Problem, reply.payload).error()
        return decode(Answer, reply.payload)

    async def ask(self, key: str, payload: bytes, timeout_s: float = 5.0) -> list[Reply]:
        """Return the replies, once the worker answers."""
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
        """Return what the worker committed: sequence and note."""
        rows = self.journal.page(OutboxQuery(only=[name], limit=10_000), {}).rows
        return [(row.seq, json.loads(row.payload)["reason"]) for row in rows]

    def committed(self, name: str = "s1") -> Notes:
        """Return the committed state."""
        text = self.journal.state(name)
        return load(text) if text else Notes(name)

    def notes(self, name: str = "s1") -> tuple[str, ...]:
        """Return the notes of the committed state."""
        return self.committed(name).notes

    def config(self) -> int:
        """Return the version of the configuration that the worker has read, committed or not."""
        state = self.worker.states.loaded("s1")
        return state.config if state else 0
