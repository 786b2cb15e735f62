"""The lines of docs/ros2.md, tried with a real rclpy node: its ``ros2`` tool comes in no wheel."""

from __future__ import annotations

import json
import re
import shlex
import time
from collections.abc import Iterator
from pathlib import Path

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

    def do(self, words: list[str]) -> None:
        match words:
            case ["ros2", "topic", "pub", "--once", topic, "std_msgs/msg/String", data]:
                text = YAML(typ="safe", pure=True).load(data.replace("DECISION_ID", self.decision_id))["data"]
                self.node.publish(topic, text)
                time.sleep(0.3)
            case ["ros2", "service", "call", name, "std_srvs/srv/Trigger", "{}"]:
                self.node.ask("service", name)
                success, message = self.node.ask("call", name)
                assert success, message
                self.decision_id = json.loads(message)["decision_id"]
                assert json.loads(message)["seen"]["gaze"] == {"ros": 0}
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
            time.sleep(1.5)
            for words in tried[4:]:
                robot.do(words)
            assert node.texts("/shift/say") == [node.said("/shift/decision")[-1]["text"]]
            assert node.said("/shift/observation")[-1]["seen"]["performance"] == 1
            assert node.said("/shift/diagnostics")[-1]["dropped"] == {"gaze": {"malformed": 1}}


def test_the_program_of_the_page_is_python() -> None:
    (program,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    compile(program, "docs/ros2.md", "exec")
