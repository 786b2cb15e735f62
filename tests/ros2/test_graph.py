"""What others see of the node, several sessions side by side, and people as ROS4HRI tells of them."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from shift_recording.mcap.reader import Recording
from shift_ros2.interfaces import INTERFACES
from support.ros_rig import Bridge, peer
from support.whole_mesh import LiveMesh, running_mesh

pytestmark = pytest.mark.timeout(280)
KINDS = {"in": "MS", "out": "MP", "service": "SS"}


@pytest.fixture(scope="module")
def mesh(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LiveMesh]:
    with running_mesh(tmp_path_factory.mktemp("mesh")) as found:
        yield found


def eventually(what: Callable[[], Any], wait_s: float = 20.0) -> None:
    until = time.monotonic() + wait_s
    while not what():
        assert time.monotonic() < until
        time.sleep(0.1)


def test_native_node_topics_and_service_are_in_the_graph(mesh: LiveMesh, tmp_path: Path) -> None:
    words = ("-r", "__ns:=/lab", "-r", "__node:=robot", "-r", "shift/gaze:=/tracker/gaze")
    with (
        Bridge(mesh.zenoh, tmp_path, "native", *words, session="graph") as bridge,
        peer("pyzeros", bridge) as robot,
    ):
        robot.ask("service", "/lab/shift/next_strategy")
        assert robot.ask("ready", "/lab/shift/next_strategy")

        def tokens_of_node() -> list[str]:
            return [t for t in robot.ask("tokens") if "/robot" in t]

        eventually(lambda: len(tokens_of_node()) >= 1 + len(INTERFACES))
        tokens = [t.split("/") for t in tokens_of_node()]
        kinds = [(t[5], *t[9:10]) for t in tokens]
        assert kinds.count(("NN",)) == 1
        expected = {i.topic: f"%lab%shift%{i.topic}" for i in INTERFACES} | {"gaze": "%tracker%gaze"}
        assert sorted(k for k in kinds if k != ("NN",)) == sorted(
            (KINDS[i.direction], expected[i.topic]) for i in INTERFACES
        )
        assert all(t[1] == "0" and t[7] == "%lab" and t[8] == "robot" for t in tokens)
        assert len({t[4] for t in tokens}) == len(tokens), "each entity has an id of its own"
        assert bridge.stop() == 0
        eventually(lambda: not [t for t in robot.ask("tokens") if "/robot" in t])


def test_rclpy_node_topics_and_service_are_in_the_graph(mesh: LiveMesh, tmp_path: Path) -> None:
    words = ("-r", "__ns:=/lab", "-r", "shift/gaze:=/tracker/gaze")
    with (
        Bridge(mesh.zenoh, tmp_path, "rclpy", *words, session="graph-rclpy") as bridge,
        peer("rclpy", bridge) as robot,
    ):
        eventually(lambda: "/lab/shift" in robot.ask("graph")["nodes"])
        eventually(lambda: "/lab/shift/next_strategy" in robot.ask("graph")["services"])
        graph = robot.ask("graph")
        assert graph["services"]["/lab/shift/next_strategy"] == ["std_srvs/srv/Trigger"]
        names = {f"/lab/shift/{i.topic}" for i in INTERFACES if i.direction != "service"}
        for name in (names - {"/lab/shift/gaze"}) | {"/tracker/gaze"}:
            assert graph["topics"][name] == ["std_msgs/msg/String"]
        assert bridge.stop() == 0


def test_two_bridges_are_two_sessions_and_one_can_reach_both(mesh: LiveMesh, tmp_path: Path) -> None:
    with (
        Bridge(mesh.zenoh, tmp_path, "native", "-r", "__ns:=/one", session="one", task="grasp") as first,
        peer("sdk", first) as robot,
    ):
        second = Bridge(mesh.zenoh, tmp_path, "native", "-r", "__ns:=/two", session="two", task="pour")
        second.line = [first.router if word == second.router else word for word in second.line]
        second.start()
        try:
            for name, session, task in (("one", "one", "grasp"), ("two", "two", "pour")):
                robot.ask("service", f"/{name}/shift/next_strategy")
                eventually(lambda name=name: robot.ask("ready", f"/{name}/shift/next_strategy"))  # type: ignore[misc]
                success, message = robot.ask("call", f"/{name}/shift/next_strategy")
                assert success
                assert (json.loads(message)["session"], json.loads(message)["task"]) == (session, task)
            robot.publish("/one/shift/task", {"session": "two", "task": "turn"})
            time.sleep(0.5)
            robot.publish("/one/shift/task", {"session": "two", "task": "turn"})
            time.sleep(0.2)
            answer = json.loads(robot.ask("call", "/one/shift/next_strategy")[1])
            assert (answer["session"], answer["task"], answer["n"]) == ("two", "turn", 2)
        finally:
            assert second.stop() == 0


def test_a_session_that_is_not_there_is_waited_for_or_begun(mesh: LiveMesh, tmp_path: Path) -> None:
    bridge = Bridge(mesh.zenoh, tmp_path, session="later", create_session="false", task="grasp")
    bridge.start(wait=False)
    try:
        bridge.wait_said("there is no session later")
        body = {"participant": "P01", "session": "later", "study": "coffee"}
        assert httpx.post(f"{mesh.url}/v1/sessions", json=body).status_code == 201
        bridge.wait_said('"state": "waits: for a Zenoh router for ROS')
    finally:
        assert bridge.stop() == 0
    with Bridge(mesh.zenoh, tmp_path, session="begun", study="coffee", participant="P07", seed=5):
        found = httpx.get(f"{mesh.url}/v1/sessions/begun").json()
        assert (found["participant"], found["study"], found["seed"]) == ("P07", "coffee", 5)
    with Bridge(mesh.zenoh, tmp_path, session="begun", participant="P99"):
        assert httpx.get(f"{mesh.url}/v1/sessions/begun").json()["participant"] == "P07", "it is there already"


def test_who_is_tracked_and_how_engaged_are_markers(mesh: LiveMesh, tmp_path: Path) -> None:
    with Bridge(mesh.zenoh, tmp_path, session="people") as bridge, peer("sdk", bridge) as robot:
        time.sleep(0.5)
        for ids in (["p1"], ["p1"], ["p1", "p2"]):
            robot.ask("tracked", ids)
            time.sleep(0.3)
        for level in (2, 2, 3):
            robot.ask("engagement", "p1", level)
            time.sleep(0.3)
    httpx.post(f"{mesh.url}/v1/sessions/people/end", timeout=30.0).raise_for_status()
    markers = [f.fact.text for f in Recording(mesh.data / "recordings" / "people.mcap").facts({"marker"})]  # type: ignore[attr-defined]
    assert markers == [
        "ROS4HRI tracked: p1",
        "ROS4HRI tracked: p1, p2",
        "ROS4HRI engagement of p1: engaging",
        "ROS4HRI engagement of p1: engaged",
    ]
