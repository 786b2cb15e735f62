"""A worker whose core hangs: it answers nothing, though its process, its bus and its token stay."""

from __future__ import annotations

import asyncio
import threading
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import zenoh
from shift_runtime.bus.zenoh import ZenohBus
from shift_runtime.bus.zenoh_config import zenoh_config
from shift_runtime.clock import SystemClock
from shift_runtime.journal import Journal
from shift_runtime.mesh_client import MeshClient
from shift_runtime.metrics import Metrics
from shift_runtime.service.loop import Worker
from shift_schemas.core_protocol import Step
from shift_schemas.errors import Unavailable
from shift_schemas.messages import Decide, Health
from shift_schemas.timestamps import Stamp
from support.runtime_fixtures import until_asked
from support.worker_rig import CORE, Notes


class Hanging(threading.Thread):
    """A worker in its own thread and loop. A decision about the task ``hang`` hangs until :attr:`let_go` is set."""

    def __init__(self, router: str, path: Path) -> None:
        super().__init__()
        self.router, self.path = router, path
        self.let_go = threading.Event()
        self.up = threading.Event()

    def step(self, state: Notes | None, message: Any, now: Stamp, timed_out: bool = False) -> Step[Notes]:
        if isinstance(message, Decide) and message.task == "hang":
            self.let_go.wait(60)
        return CORE.step(state or Notes("s1", 1), message, now, timed_out)

    def run(self) -> None:
        asyncio.run(self._run())

    async def _run(self) -> None:
        bus = await ZenohBus.open(self.router, "tcp/127.0.0.1:0")
        core = replace(CORE, step=self.step, reads={})
        self.worker = Worker(core, bus, Journal(self.path, "decider"), SystemClock(), Metrics("decider"))
        self.loop = asyncio.get_running_loop()
        self.up.set()
        await self.worker.run()
        await bus.close()


async def _health(client: MeshClient) -> Health | None:
    return (await client.healths())["decider"]


@pytest.mark.anyio
async def test_hung_worker_answers_neither_health_nor_outbox_though_its_token_stays(
    router: str, tmp_path: Path
) -> None:
    hanging = Hanging(router, tmp_path / "decider.sqlite")
    hanging.start()
    assert await asyncio.to_thread(hanging.up.wait, 30)
    bus = await ZenohBus.open(router, "tcp/127.0.0.1:0")
    watcher = await asyncio.to_thread(zenoh.open, zenoh_config("client", connect=router))
    client = MeshClient([bus], patience_s=1.5)
    try:
        await until_asked(lambda: _health(client))
        assert (await client.command(Decide(command_id="d1", session="s1", task="any"))).seq == 1
        with pytest.raises(Unavailable, match="the decider does not answer"):
            await client.command(Decide(command_id="d2", session="s1", task="hang"))
        assert (await client.healths())["decider"] is None
        alive = await asyncio.to_thread(
            lambda: list(watcher.liveliness().get("shift/v1/@service/decider/alive", timeout=1.0))
        )
        assert any(reply.ok for reply in alive)
        hanging.let_go.set()
        await until_asked(lambda: _health(client))
        repeat = await client.command(Decide(command_id="d2", session="s1", task="hang"))
        assert repeat.repeat
        assert repeat.seq == 2
    finally:
        hanging.let_go.set()
        hanging.loop.call_soon_threadsafe(hanging.worker.stop)
        await asyncio.to_thread(hanging.join, 30)
        await bus.close()
        watcher.close()
    assert not hanging.is_alive()
