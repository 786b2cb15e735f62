"""The lines of docs/ros2.md, tried with a real rclpy node: its ``ros2`` tool comes in no wheel."""

from __future__ import annotations

import json
import re
import shlex
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from ruamel.yaml import YAML
from support.ros_environments import ROOT
from support.ros_rig import Bridge, Peer, peer
from support.whole_mesh import running_mesh

pytestmark = pytest.mark.timeout(280)
PAGE = (ROOT / "docs" / "ros2.md").read_text()


def lines(mark: str) -> Iterator[list[str]]:
    """The words of each line in the blocks with this mark."""
    for block in re.findall(rf"<!-- {mark} -->\n```sh\n(.*?)```", PAGE, re.DOTALL):
        yield from (shlex.split(line) for line in block.splitlines())


class Robot:
    """The ``ros2`` tool's words, done by a peer."""

    def __init__(self, node: Peer) -> None:
        self.node = node
        self.decision_id = ""
        self.gaze = ""

    def decision_that_saw_the_gaze(self, service: str) -> dict[str, Any]:
        """Return a call's answer. Gaze is best effort: it can be late or lost, so it is published again each second."""
        end = time.monotonic() + 30
        while True:
            success, message = self.node.ask("call", service)
            assert success, message
            decision: dict[str, Any] = json.loads(message)
            if "ros" in decision["seen"]["gaze"]:
                return decision
            assert time.monotonic() < end, decision
            time.sleep(1)
            self.node.publish("/shift/gaze", self.gaze)

    def do(self, words: list[str]) -> None:
        match words:
            case ["ros2", "topic", "pub", "--once", topic, "std_msgs/msg/String", data]:
                text = YAML(typ="safe", pure=True).load(data.replace("DECISION_ID", self.decision_id))["data"]
                if topic == "/shift/gaze":
                    self.gaze = text
                self.node.publish(topic, text)
                time.sleep(0.3)
            case ["ros2", "service", "call", name, "std_srvs/srv/Trigger", "{}"]:
                self.node.ask("service", name)
                self.decision_id = self.decision_that_saw_the_gaze(name)["decision_id"]
            case ["ros2", "topic", "echo", topic, "std_msgs/msg/String"]:
                assert self.node.texts(topic), topic
            case _:
                raise AssertionError(words)


@pytest.mark.parametrize(("backend", "name"), [("native", "pyzeros"), ("rclpy", "rclpy")])
def test_the_lines_of_the_page_work(backend: str, name: str, tmp_path: Path) -> None:
    up, started = list(lines("started"))
    assert up == ["shift-mesh", "up"]
    assert started[:4] == ["shift-mesh", "ros2", "--session", "s1"]
    with running_mesh(tmp_path) as mesh:
        parameters = dict(word.split(":=") for word in started if ":=" in word)
        with (
            Bridge(mesh.zenoh, tmp_path, backend, **{"session": "s1", **parameters}) as bridge,
            peer(name, bridge) as node,
        ):
            robot = Robot(node)
            for topic in ("decision", "observation", "say", "diagnostics"):
                node.ask("hear", f"/shift/{topic}")
            time.sleep(0.5)
            tried = list(lines("tried"))
            assert len(tried) == 8
            for words in tried[:4]:
                robot.do(words)
            node.publish("/shift/gaze", "{")
            mesh.until(lambda: any(m["seen"]["performance"] == 1 for m in node.said("/shift/observation")))
            mesh.until(lambda: any(m["dropped"] == {"gaze": {"malformed": 1}} for m in node.said("/shift/diagnostics")))
            for words in tried[4:]:
                robot.do(words)
            mesh.until(lambda: node.texts("/shift/say")[-1:] == [node.said("/shift/decision")[-1]["text"]])


def test_the_program_of_the_page_is_python() -> None:
    (program,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    compile(program, "docs/ros2.md", "exec")
