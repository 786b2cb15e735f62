"""The recorder in the test's process; the test plays the services that the recorder waits for."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from shift_recorder.core import RecorderState
from shift_recorder.service import CORE, extend
from shift_recorder.service.convergence import PEERS
from shift_runtime.bus.memory import Hub, MemoryBus
from shift_runtime.bus.protocol import Reply, Request
from shift_runtime.clock import ManualClock
from shift_runtime.metrics import Metrics
from shift_runtime.service.loop import Worker
from shift_runtime.settings import ServiceSettings
from shift_schemas.codec import decode, encode
from shift_schemas.errors import Problem
from shift_schemas.keys import CommandKey, ServiceKey, build_key
from shift_schemas.messages import Answer, Command, EndSession, OutboxPage, OutboxQuery, StartSession
from shift_schemas.registry import READS

from support.runtime_fixtures import until
from support.worker_rig import FullDisk, RunningWorker

END = EndSession(command_id="end", session="s1")


@dataclass
class Peer:
    """A service that publishes nothing, and that has read whatever it is told to have read."""

    name: str
    read: dict[str, int] = field(default_factory=dict)

    def page(self, request: Request) -> None:
        query = decode(OutboxQuery, request.payload)
        sessions = query.only or []
        page = OutboxPage(
            owner=self.name, rows=[], heads=dict.fromkeys(sessions, 0), complete=True,
            cursors={session: dict(self.read) for session in sessions},
        )  # fmt: skip
        request.reply(encode(page))


@dataclass
class RecorderRig(RunningWorker):
    """A recorder with a data folder of its own."""

    data: Path
    hub: Hub = field(default_factory=Hub)

    def __post_init__(self) -> None:
        self.bus = MemoryBus(self.hub)
        self.peers = {name: Peer(name) for name in PEERS}
        for name, peer in self.peers.items():
            self.bus.serve(build_key(ServiceKey(name, "outbox")), peer.page)

    def start(self) -> None:
        self.journal = FullDisk(self.data / "state" / "recorder.sqlite", "recorder")
        self.own_bus, self.metrics = MemoryBus(self.hub), Metrics("recorder")
        settings = ServiceSettings(data=self.data)
        self.worker: Worker[RecorderState] = Worker(
            CORE, self.own_bus, self.journal, ManualClock(5), self.metrics, partial(extend, settings=settings)
        )
        self.running = asyncio.create_task(self.worker.run())

    async def send(self, command: Command) -> Answer:
        """Return the answer, or raise the refusal."""
        key = build_key(CommandKey(command.session, command.procedure))
        replies: list[Reply] = []

        while not replies:
            replies = await self.bus.get(key, encode(command), timeout_s=10.0)
            await asyncio.sleep(0)
        if not replies[0].ok:
            raise decode(Problem, replies[0].payload).error()
        return decode(Answer, replies[0].payload)

    async def begin(self, **given: Any) -> None:
        """Start session s1."""
        await self.send(
            StartSession(**{"command_id": "start", "session": "s1", "participant": "P1", "study": "default", **given})
        )

    def caught_up(self, messages: int) -> None:
        """Let every peer have read so many messages of the recorder."""
        for name, peer in self.peers.items():
            peer.read = dict.fromkeys(READS[name], 0) | {"recorder": messages}

    async def recorded(self, messages: int) -> None:
        """Wait until the recorder has processed so many messages of its own."""
        await until(lambda: self.worker.progress.processed.get(("s1", "recorder"), 0) == messages)

    @property
    def recording(self) -> Path:
        return self.data / "recordings" / "s1.mcap"

    @property
    def segments(self) -> list[Path]:
        return sorted((self.data / "segments" / "s1").glob("*.mcap"))

    def state(self) -> str:
        state = self.worker.states.get("s1")
        return state.fact.state if state is not None else ""
