"""ROS 1 with a real roscore and real rospy nodes: kills of the bridge, a restarted master, and RISE's interface."""

from __future__ import annotations

import hashlib
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from shift_recording.mcap.reader import Recording
from shift_schemas.messages import Decision, Gaze
from support.ros_rig import Bridge, Peer, Roscore, peer
from support.whole_mesh import LiveMesh, running_mesh

pytestmark = pytest.mark.timeout(280)
RESULT = {"success": True, "duration_s": 2.5}
FIELDS = "string domain_task_behavior,string function_type,string calling_type"


@pytest.fixture(scope="module")
def mesh(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LiveMesh]:
    with running_mesh(tmp_path_factory.mktemp("mesh")) as found:
        yield found


def wait_for(what: Callable[[], object], wait_s: float = 20.0) -> None:
    until = time.monotonic() + wait_s
    while not what():
        assert time.monotonic() < until
        time.sleep(0.05)


def decide_again_until_answered(robot: Peer) -> dict[str, Any]:
    """Return a decision: call as a robot's program does, again and again, while the bridge is away."""
    until = time.monotonic() + 30
    while (decision := robot.decide(5.0)) is None:
        assert time.monotonic() < until
        time.sleep(0.2)
    return decision


def report_until_counted(robot: Peer, decision: dict[str, Any], count: int) -> None:
    """Publish a report until the observation has counted it, since a topic acknowledges nothing."""
    report = {"decision_id": decision["decision_id"], "comprehension": RESULT, "enabledness": RESULT}
    until = time.monotonic() + 30
    while True:
        robot.publish("/shift/task_performance", report)
        robot.ask("wait_heard", "/shift/observation", len(robot.said("/shift/observation")) + 1, 0.5)
        if any(o["seen"].get("performance", 0) >= count for o in robot.said("/shift/observation")[-3:]):
            return
        assert time.monotonic() < until


def ended(mesh: LiveMesh, session: str) -> list[Any]:
    """End the session and return its recorded facts, after verifying them."""
    answer = httpx.post(f"{mesh.url}/v1/sessions/{session}/end", timeout=30.0)
    assert answer.status_code == 200, answer.text
    path = mesh.data / "recordings" / answer.json()["recording"]
    command = [sys.executable, "-m", "shift_cli.main", "verify", str(path), "--json"]
    found = subprocess.run(command, capture_output=True, text=True, check=False)
    assert found.returncode == 0, found.stdout + found.stderr
    return [recorded.fact for recorded in Recording(path).facts()]


def test_kills_of_the_bridge_and_a_restarted_master_lose_nothing(mesh: LiveMesh, tmp_path: Path) -> None:
    """Every acknowledged decision and counted report is recorded once, and gaze goes on after each fault."""
    acknowledged: list[str] = []
    parameters = {"study": "coffee", "task": "grasp"}
    with (
        Bridge(mesh.zenoh, tmp_path, "rospy", session="faults", **parameters) as bridge,
        peer("rospy", bridge) as robot,
    ):
        robot.ask("hear", "/shift/observation")
        robot.ask("service", "/shift/next_strategy")
        for n in range(1, 13):
            if n in (4, 8):
                bridge.kill()
                bridge.start()
            if n == 6:
                bridge.master.stop()
                bridge.wait_said("waits: for the ROS master", bridge.log.stat().st_size)
                bridge.master.start()
                bridge.wait_said("registered again", 0)
            robot.publish("/shift/gaze", {"source": "tx", "t": float(n), "x": 0.1, "y": 0.5})
            decision = decide_again_until_answered(robot)
            acknowledged.append(decision["decision_id"])
            report_until_counted(robot, decision, n)
        late = Peer("rospy", bridge)  # a node that joins after the restart finds everything at the new master
        try:
            late.ask("service", "/shift/next_strategy")
            assert late.decide() is not None
        finally:
            late.stop()
    facts = ended(mesh, "faults")
    recorded = [fact.decision_id for fact in facts if isinstance(fact, Decision)]
    assert set(acknowledged) <= set(recorded)
    assert len(recorded) == len(set(recorded))
    assert sum(fact.subject == "performance" for fact in facts) == len(acknowledged)
    times = [t for fact in facts if isinstance(fact, Gaze) for t in fact.t]
    assert times == sorted(set(times))
    assert {1.0, 2.0, 3.0, 12.0} <= set(times)


def test_bridge_waits_for_a_master_that_comes_later(mesh: LiveMesh, tmp_path: Path) -> None:
    bridge = Bridge(mesh.zenoh, tmp_path, "rospy", session="later", task="grasp")
    try:
        bridge.start(wait=False)
        bridge.wait_said(f"waits: for the ROS master at {bridge.master.env['ROS_MASTER_URI']}")
        bridge.master.start()
        bridge.wait_said('"state": "ready"')
        with peer("rospy", bridge) as robot:
            robot.ask("service", "/shift/next_strategy")
            assert robot.decide() is not None
    finally:
        code = bridge.stop()
        bridge.master.stop()
    assert code == 0, bridge.log.read_text()


def test_words_are_those_of_ros_1(mesh: LiveMesh, tmp_path: Path) -> None:
    """roslaunch passes names, parameters and remaps in this form."""
    words = ("__name:=partner", "__ns:=/lab", "_session:=words", "_create_session:=true", "_task:=grasp",
             "shift/next_strategy:=/ask", "__log:=/dev/null")  # fmt: skip
    master = Roscore(tmp_path)
    master.start()
    env = {k: v for k, v in os.environ.items() if not k.startswith(("SHIFT_", "ROS_"))} | master.env
    command = [sys.executable, "-m", "shift_cli.main", "ros1", "--zenoh", mesh.zenoh, *words]
    bridge = subprocess.Popen(command, env=env)
    try:
        caller = ("import rospy; from std_srvs.srv import Trigger; rospy.wait_for_service('/ask', 30); "
                  "print(rospy.ServiceProxy('/ask', Trigger)().message)")  # fmt: skip
        found = subprocess.run(["/usr/bin/python3", "-c", caller], env=env, capture_output=True, text=True, timeout=60)
        assert json.loads(found.stdout)["task"] == "grasp", found.stderr
    finally:
        bridge.send_signal(signal.SIGINT)
        assert bridge.wait(20) == 0
        master.stop()


def dropped(robot: Peer) -> int:
    """Return how many messages the newest diagnostics count as dropped."""
    newest = robot.said("/shift/diagnostics")[-1:]
    return sum(sum(reasons.values()) for said in newest for reasons in said["dropped"].values())


def test_wrong_messages_are_counted_and_answered(mesh: LiveMesh, tmp_path: Path) -> None:
    with (
        Bridge(mesh.zenoh, tmp_path, "rospy", session="wrong") as bridge,
        peer("rospy", bridge) as robot,
    ):
        robot.ask("hear", "/shift/diagnostics")
        robot.ask("service", "/shift/next_strategy")
        success, message = robot.ask("call", "/shift/next_strategy", 10.0)
        assert not success
        assert "publish" in json.loads(message)["detail"]
        for text in ("no JSON", '{"t": 1}', "[" * 5000, "x" * 300_000):
            robot.publish("/shift/gaze", text)
        wait_for(lambda: dropped(robot) == 5)
        robot.publish("/shift/task", {"task": "a"})
        time.sleep(0.2)
        assert robot.decide() is not None


def test_rise_gets_each_decision_in_its_memory_and_then_an_event(mesh: LiveMesh, tmp_path: Path) -> None:
    parameters = {"rise_memory": "true", "rise_event": "true", "study": "coffee", "task": "grasp"}
    with (
        Bridge(mesh.zenoh, tmp_path, "rospy", session="rise", **parameters) as bridge,
        peer("rospy", bridge) as robot,
    ):
        robot.ask("service", "/shift/next_strategy")
        early = robot.decide()
        with peer("rise_stand_in", bridge, FIELDS) as rise:
            assert early is not None
            wait_for(lambda: rise.ask("state")["memory"])  # RISE was not there, so the goals are sent when it comes
            decisions = [early]
            for n in range(2, 6):
                decisions.append(decide_again_until_answered(robot))
                wait_for(lambda n=n: len(rise.ask("state")["events"]) == n)
            state = rise.ask("state")
        with peer("rise_stand_in", bridge, FIELDS) as again:  # a RISE that starts again knows the newest decision
            wait_for(lambda: again.ask("state")["memory"])
            assert again.ask("state")["memory"] == state["memory"]
            assert again.ask("state")["events"] == []
    ids = [decision["decision_id"] for decision in decisions]
    assert state["events"] == [["shift_decision", decision_id] for decision_id in ids]
    assert state["goals"] == [
        [f"shift-{decision_id}-{what}", function, "None"]
        for decision_id in ids
        for what, function in (("memory", "assignValue"), ("event", "raiseEventTopic"))
    ]
    newest = decisions[-1]
    assert state["memory"] == {"shift": {
        "session": "rise", "decision_id": newest["decision_id"], "n": 5, "task": "grasp", "text": newest["text"],
        "strategy": newest["strategy"], "cognitive_state": newest["cognitive_state"],
    }}  # fmt: skip


def test_definition_of_the_action_can_be_replaced(mesh: LiveMesh, tmp_path: Path) -> None:
    """ROS compares checksums, so goals arrive only where the definitions are the same."""
    fields = "string function_type,string domain_task_behavior,string calling_type,bool urgent"
    action = tmp_path / "Theirs.action"
    action.write_text(fields.replace(",", "\n") + "\n---\nbool done\n---\nfloat32 progress\n")
    parameters = {"rise_memory": "true", "rise_action": str(action), "task": "a"}
    with (
        Bridge(mesh.zenoh, tmp_path, "rospy", session="theirs", **parameters) as bridge,
        peer("rospy", bridge) as robot,
        peer("rise_stand_in", bridge, fields) as rise,
    ):
        parts = [f"{fields.replace(',', chr(10))}"]
        inner = hashlib.md5(parts[0].encode()).hexdigest()
        header, goal_id = "2176decaecbce78abc3b96ef049fabed", "302881f31927c1df708a2dbab0e80ee8"
        text = f"{header} header\n{goal_id} goal_id\n{inner} goal"
        assert rise.ask("checksum") == hashlib.md5(text.encode()).hexdigest()
        robot.ask("service", "/shift/next_strategy")
        decision = robot.decide()
        assert decision is not None
        wait_for(lambda: rise.ask("state")["memory"])
        assert rise.ask("state")["memory"]["shift"]["decision_id"] == decision["decision_id"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (None, "cannot be read"),
        ("string a\n---\n", "three parts"),
        ("string domain_task_behavior\n---\n---\n", "has no field calling_type"),
        ("nonsense domain_task_behavior\n---\n---\n", "is not a ROS message"),
    ],
)
def test_wrong_definition_is_refused_at_the_start(text: str | None, said: str, tmp_path: Path) -> None:
    action = tmp_path / "Theirs.action"
    if text is not None:
        action.write_text(text)
    words = ["_rise_memory:=true", f"_rise_action:={action}", "--zenoh", "tcp/127.0.0.1:1"]
    bridge = subprocess.run(
        [sys.executable, "-m", "shift_cli.main", "ros1", *words], capture_output=True, text=True, timeout=60
    )
    assert bridge.returncode == 2
    assert said in bridge.stderr
    assert str(action) in bridge.stderr
