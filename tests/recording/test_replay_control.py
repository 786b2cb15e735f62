"""A running replay is controlled over the mesh; what it cannot do is refused with a sentence."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any

import pytest
from shift_recording.replay import Pacer
from shift_recording.replay_control import ControlledReplay
from shift_runtime.bus.memory import Hub, MemoryBus
from shift_runtime.mesh_client import MeshClient
from shift_schemas.codec import decode
from shift_schemas.errors import Conflict, MalformedMessage, ShiftError, UnknownThing
from shift_schemas.messages import ReplayControl, ReplayStatus

Scenario = Callable[[MeshClient, ControlledReplay, list[str]], Coroutine[Any, Any, None]]


def controlled(scenario: Scenario, inputs: bool = False) -> None:
    """Run a scenario with a replay of 100 s and a client of its mesh."""

    async def run() -> None:
        hub = Hub()
        stopped: list[str] = []
        pacer = Pacer(2.0, lambda: 0.0)
        replay = ControlledReplay("again", "s1.mcap", 100.0, pacer, lambda: stopped.append("stop"), lambda: 7, inputs)
        replay.serve(MemoryBus(hub))
        await scenario(MeshClient([MemoryBus(hub)]), replay, stopped)

    asyncio.run(run())


def test_status_says_how_far_it_is() -> None:
    async def scenario(client: MeshClient, replay: ControlledReplay, stopped: list[str]) -> None:
        status = await client.control_replay("again")
        assert status == ReplayStatus(
            session="again", recording="s1.mcap", position_s=0.0, length_s=100.0, rate=2.0, paused=False, published=7
        )
        assert await client.replays() == [status]

    controlled(scenario)


def test_every_control_has_its_effect() -> None:
    async def scenario(client: MeshClient, replay: ControlledReplay, stopped: list[str]) -> None:
        status = await client.control_replay("again", ReplayControl(paused=True, rate=5.0, position_s=40.0))
        assert (status.paused, status.rate, status.position_s) == (True, 5.0, 40.0)
        assert replay.pacer.is_jumping
        assert not (await client.control_replay("again", ReplayControl(paused=False))).paused
        assert (await client.control_replay("again", ReplayControl(step=True))).paused
        assert not stopped
        await client.control_replay("again", ReplayControl(stop=True))
        assert stopped == ["stop"]

    controlled(scenario)


@pytest.mark.parametrize(
    ("control", "inputs", "kind", "says"),
    [
        (ReplayControl(), False, MalformedMessage, "give paused, rate"),
        (ReplayControl(position_s=101.0), False, MalformedMessage, "has 100.0 s"),
        (ReplayControl(position_s=1.0), True, Conflict, "cannot seek"),
    ],
)
def test_what_it_cannot_do_is_refused(control: ReplayControl, inputs: bool, kind: type[ShiftError], says: str) -> None:
    async def scenario(client: MeshClient, replay: ControlledReplay, stopped: list[str]) -> None:
        with pytest.raises(kind, match=says):
            await client.control_replay("again", control)

    controlled(scenario, inputs)


def test_replay_that_does_not_run_is_unknown() -> None:
    async def scenario(client: MeshClient, replay: ControlledReplay, stopped: list[str]) -> None:
        with pytest.raises(UnknownThing, match="no replay runs under session other"):
            await client.control_replay("other")

    controlled(scenario)


def test_status_is_published() -> None:
    async def run() -> None:
        hub = Hub()
        heard: list[ReplayStatus] = []
        MemoryBus(hub).subscribe("shift/v1/@replay/*", lambda i: heard.append(decode(ReplayStatus, i.payload)))
        pacer = Pacer(1.0, lambda: 3.0)
        replay = ControlledReplay("again", "s1.mcap", 100.0, pacer, lambda: None, lambda: 1)
        bus = MemoryBus(hub)
        await replay.publish_once(bus)
        await replay.publish_once(bus)
        assert [status.session for status in heard] == ["again", "again"]

    asyncio.run(run())
