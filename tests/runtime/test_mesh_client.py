"""The mesh client: it repeats a request with the same id, and names the service that does not answer or refuses."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest
from shift_runtime import mesh_client as mesh_client_module
from shift_runtime.bus.memory import Hub, MemoryBus
from shift_runtime.bus.protocol import Request
from shift_runtime.mesh_client import MeshClient
from shift_schemas.codec import encode
from shift_schemas.errors import Conflict, FieldError, MalformedMessage, Problem, Unavailable
from shift_schemas.messages import Answer, Decide, GazeChunk, Health, OutboxQuery
from support.runtime_fixtures import loads, until
from support.worker_rig import Rig, config, session

pytestmark = pytest.mark.anyio
DECIDE = Decide(command_id="d1", session="s1", task="grasp")
ANSWER = Answer(owner="decider", seq=3, result={"n": 1})
KEY = "shift/v1/s1/rpc/decide"


@pytest.fixture(autouse=True)
def hasty(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mesh_client_module, "ATTEMPT_S", 0.05)
    monkeypatch.setattr(mesh_client_module, "PAUSE_S", 0.005)


@pytest.fixture
async def bus() -> MemoryBus:
    return MemoryBus(Hub())


async def test_answer_is_returned_unchanged(bus: MemoryBus) -> None:
    bus.serve("shift/v1/*/rpc/decide", lambda r: r.reply(encode(ANSWER)))
    assert await MeshClient([bus]).command(DECIDE) == ANSWER


async def test_command_without_a_reply_is_sent_again_with_the_same_id(bus: MemoryBus) -> None:
    asked: list[Request] = []

    def third_time(request: Request) -> None:
        asked.append(request)
        if len(asked) == 3:
            request.reply(encode(ANSWER))

    bus.serve("shift/v1/*/rpc/decide", third_time)
    assert await MeshClient([bus]).command(DECIDE) == ANSWER
    assert [loads(r.payload)["command_id"] for r in asked] == ["d1"] * 3
    assert len({r.payload for r in asked}) == 1


async def test_service_that_comes_back_in_time_answers(bus: MemoryBus) -> None:
    asking = asyncio.create_task(MeshClient([bus]).command(DECIDE))
    await asyncio.sleep(0.05)
    bus.serve(KEY, lambda r: r.reply(encode(ANSWER)))
    assert await asking == ANSWER


async def test_missing_service_is_a_failure_that_names_it(bus: MemoryBus) -> None:
    client = MeshClient([bus], patience_s=0.05)
    with pytest.raises(Unavailable, match="the decider does not answer"):
        await client.command(DECIDE)
    with pytest.raises(Unavailable, match="the monitor does not answer"):
        await client.send("s1", GazeChunk(source="eyes", seq=0, t=[0.0], aoi=["left"]))


async def test_silent_service_is_a_failure_that_names_it(bus: MemoryBus) -> None:
    silent: list[Request] = []
    bus.serve(KEY, silent.append)
    with pytest.raises(Unavailable, match="the decider does not answer"):
        await MeshClient([bus], patience_s=0.12).command(DECIDE)
    assert len(silent) >= 2


async def test_patience_grows_by_the_service_s_own_wait(bus: MemoryBus) -> None:
    bus.serve(KEY, lambda r: asyncio.get_running_loop().call_later(0.04, r.reply, encode(ANSWER)))
    assert await MeshClient([bus], patience_s=0.0).command(DECIDE, wait_s=1.0) == ANSWER


async def test_refusal_arrives_as_the_same_error_and_is_not_retried(bus: MemoryBus) -> None:
    asked: list[Request] = []
    errors = (FieldError(field="task", value="x", rule="no"),)

    def refuse(request: Request) -> None:
        asked.append(request)
        request.refuse(encode(Problem.of(Conflict("asked before", errors))))

    bus.serve(KEY, refuse)
    with pytest.raises(Conflict, match="asked before") as found:
        await MeshClient([bus]).command(DECIDE)
    assert found.value.errors == errors
    assert len(asked) == 1


@pytest.mark.parametrize("junk", [b"", b"Timeout", b"\xff", b"{}", encode(OutboxQuery())])
@pytest.mark.parametrize("ok", [True, False])
async def test_invalid_answer_is_ignored(bus: MemoryBus, junk: bytes, ok: bool) -> None:
    bus.serve(KEY, lambda r: r.reply(junk) if ok else r.refuse(junk))
    with pytest.raises(Unavailable):
        await MeshClient([bus], patience_s=0.05).command(DECIDE)
    bus.serve(KEY, lambda r: r.reply(encode(ANSWER)))
    assert await MeshClient([bus]).command(DECIDE) == ANSWER


async def test_session_that_is_not_an_id_is_refused_before_a_request(bus: MemoryBus) -> None:
    chunk = GazeChunk(source="eyes", seq=0, t=[0.0], aoi=["left"])
    for hostile in ("**", "*", "a/b", "../x", "a\0", "x" * 64, ""):
        with pytest.raises(MalformedMessage):
            await MeshClient([bus]).send(hostile, chunk)


async def test_health_is_none_and_metrics_are_empty_without_an_answer(bus: MemoryBus) -> None:
    client = MeshClient([bus])
    assert (await client.healths(0.02))["monitor"] is None
    assert await client.metrics("monitor", 0.02) == []
    bus.serve("shift/v1/@service/monitor/health", lambda r: r.reply(b"junk"))
    bus.serve("shift/v1/@service/monitor/metrics", lambda r: r.refuse(b"no"))
    assert (await client.healths(0.02))["monitor"] is None
    assert await client.metrics("monitor", 0.02) == []
    healthy = Health(service="monitor", ready=True)
    bus.serve("shift/v1/@service/monitor/health", lambda r: r.reply(encode(healthy)))
    bus.serve("shift/v1/@service/monitor/metrics", lambda r: r.reply(b"# text"))
    assert (await client.healths(0.1))["monitor"] == healthy
    assert await client.metrics("monitor") == [b"# text"]


async def test_command_is_carried_out_once_even_if_attempts_time_out(tmp_path: Path) -> None:
    rig = Rig(tmp_path / "decider.sqlite")
    rig.recorder.publish(session(), config())
    rig.start()
    await rig.ready()
    client = MeshClient([rig.bus])
    answer = await client.command(DECIDE.model_copy(update={"task": "after-2"}), wait_s=1.0)
    assert answer.result["timed_out"] is True
    await until(lambda: rig.outbox() == [(1, "decision d1")])
    await rig.stop()
