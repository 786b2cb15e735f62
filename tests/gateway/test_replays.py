"""Running replays over REST: listed, controlled, and refused with a problem."""

from __future__ import annotations

import pytest
from shift_recording.replay import Pacer
from shift_recording.replay_control import ControlledReplay
from shift_runtime.bus.memory import MemoryBus
from support.gateway_mesh import Mesh

pytestmark = pytest.mark.anyio


async def test_replay_is_listed_and_controlled(mesh: Mesh) -> None:
    assert (await mesh.ask("GET", "/v1/replays")).json() == {"replays": []}
    pacer = Pacer(1.0, lambda: 0.0)
    bus = MemoryBus(mesh.hub)
    ControlledReplay("again", "s1.mcap", 60.0, pacer, lambda: None, lambda: 3).serve(bus)
    (listed,) = (await mesh.ask("GET", "/v1/replays")).json()["replays"]
    assert (listed["session"], listed["recording"], listed["length_s"], listed["published"]) == (
        "again",
        "s1.mcap",
        60.0,
        3,
    )
    answer = await mesh.ask("PATCH", "/v1/replays/again", {"paused": True, "position_s": 12.5})
    assert answer.status_code == 200
    assert (answer.json()["paused"], answer.json()["position_s"]) == (True, 12.5)
    assert (await mesh.ask("GET", "/v1/replays/again")).json()["position_s"] == 12.5
    await bus.close()


@pytest.mark.parametrize(
    ("name", "body", "status"),
    [("nowhere", {"paused": True}, 404), ("a b", {"paused": True}, 422), ("nowhere", {"rate": 0}, 422),
     ("nowhere", {"speed": 2}, 422)],
)  # fmt: skip
async def test_wrong_control_is_a_problem(mesh: Mesh, name: str, body: dict[str, object], status: int) -> None:
    answer = await mesh.ask("PATCH", f"/v1/replays/{name}", body)
    assert answer.status_code == status
    assert answer.headers["content-type"] == "application/problem+json"
