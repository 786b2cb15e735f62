"""A request that has to wait: others go on meanwhile, and a bridge that stops says so. The same on both backends."""

from __future__ import annotations

import json
import os
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import pytest
from support.ros_rig import Bridge, Peer, peer
from support.whole_mesh import LiveMesh, running_mesh

pytestmark = pytest.mark.timeout(280)
BOTH = pytest.mark.parametrize(("name", "backend"), [("pyzeros", "native"), ("rclpy", "rclpy")])


@pytest.fixture(scope="module")
def mesh(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LiveMesh]:
    with running_mesh(tmp_path_factory.mktemp("mesh")) as found:
        yield found


@contextmanager
def suspended(pid: int) -> Iterator[None]:
    """The process does nothing until left."""
    os.kill(pid, signal.SIGSTOP)
    try:
        yield
    finally:
        os.kill(pid, signal.SIGCONT)


class Asking(threading.Thread):
    """A call in the background; the peer does nothing else meanwhile."""

    def __init__(self, robot: Peer) -> None:
        super().__init__()
        self.robot = robot
        self.answer: Any = None
        self.start()

    def run(self) -> None:
        self.answer = self.robot.ask("call", "/shift/next_strategy", 20.0)

    def result(self) -> Any:
        self.join(30)
        assert not self.is_alive()
        return self.answer


@BOTH
def test_gaze_is_taken_while_a_request_waits(name: str, backend: str, mesh: LiveMesh, tmp_path: Path) -> None:
    session = f"waits-{backend}"
    with Bridge(mesh.zenoh, tmp_path, backend, session=session, task="grasp") as bridge, peer(name, bridge) as robot:
        robot.ask("service", "/shift/next_strategy")
        assert robot.decide() is not None
        gaze = tmp_path / "gaze.jsonl"
        gaze.write_text("\n".join(json.dumps({"t": i / 100, "aoi": "left"}) for i in range(300)))

        def seen() -> int:
            found = httpx.get(f"{mesh.url}/v1/sessions/{session}/observation").json()
            return int(found["seen"]["gaze"].get("ros", -1))

        with suspended(mesh.pid_of("shift_decider")):
            robot.ask("play", "/shift/gaze", str(gaze), 100.0)
            asking = Asking(robot)
            time.sleep(0.5)
            before = seen()
            time.sleep(1.0)
            assert seen() > before
            assert asking.is_alive()
        success, message = asking.result()
        assert success, message
        assert json.loads(message)["n"] == 2


@BOTH
def test_a_bridge_that_stops_answers_the_request_that_waits(
    name: str, backend: str, mesh: LiveMesh, tmp_path: Path
) -> None:
    session = f"stops-{backend}"
    with Bridge(mesh.zenoh, tmp_path, backend, session=session, task="grasp") as bridge, peer(name, bridge) as robot:
        robot.ask("service", "/shift/next_strategy")
        assert robot.decide() is not None
        with suspended(mesh.pid_of("shift_decider")):
            asking = Asking(robot)
            time.sleep(0.5)
            assert bridge.stop() == 0
            success, message = asking.result()
        assert not success
        assert json.loads(message)["kind"] == "unavailable"
        assert "stopping" in json.loads(message)["detail"]


@BOTH
def test_aois_move_with_the_gaze_of_a_ros_source(name: str, backend: str, mesh: LiveMesh, tmp_path: Path) -> None:
    session = f"moves-{backend}"
    with Bridge(mesh.zenoh, tmp_path, backend, session=session, task="grasp") as bridge, peer(name, bridge) as robot:
        robot.ask("service", "/shift/next_strategy")
        place = {"name": "left", "rectangle": [0.8, 0.0, 1.0, 1.0]}
        hidden = {"name": "right", "visible": False}
        gaze = [{"t": i / 50, "x": 0.9, "y": 0.5} for i in range(100)]
        lines = {"aois": [{"t": 0.0, "aois": [place, hidden]}], "gaze": gaze}
        for topic, messages in lines.items():
            path = tmp_path / f"{topic}.jsonl"
            path.write_text("\n".join(map(json.dumps, messages)))
            robot.ask("play", f"/shift/{topic}", str(path), 100.0)
            time.sleep(0.5)
        assert robot.decide() is not None
        found = httpx.get(f"{mesh.url}/v1/sessions/{session}/observation").json()["gaze"]
    assert found["aoi"] == "left"
    assert found["weights"]["left"] > found["weights"]["right"]
