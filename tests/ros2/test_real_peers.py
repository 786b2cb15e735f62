"""100 interactions with real ROS peers: the contract that every backend and every peer passes alike."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from shift_recording.mcap.reader import Recording
from shift_sources.files.formats import read_samples
from support.ros_environments import REQUIREMENTS, ROOT, python_of
from support.ros_rig import Bridge, Peer, peer
from support.whole_mesh import LiveMesh, running_mesh

pytestmark = pytest.mark.timeout(280)
PEERS = {"pyzeros": "native", "sdk": "native", "rclpy": "rclpy", "rospy": "rospy"}
INTERACTIONS = 100
TRIALS = sorted((ROOT / "tests" / "data" / "gaze").glob("*.tsv.gz"))
RATE_HZ = 300.0
RESULT = {"success": True, "duration_s": 2.5}


@pytest.fixture(scope="module")
def mesh(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LiveMesh]:
    with running_mesh(tmp_path_factory.mktemp("mesh")) as found:
        yield found


def gaze_lines(folder: Path, trials: list[Path]) -> tuple[Path, int]:
    """Every sample of the recordings as a message of its own, one clock for all."""
    lines, offset = [], 0.0
    for trial in trials:
        found = list(read_samples(trial))
        for s in found:
            lines.append(json.dumps({"source": "tx300", "t": offset + s.t, "x": s.x, "y": s.y, "valid": s.valid}))
        offset += found[-1].t + 1 / RATE_HZ
    file = folder / "gaze.jsonl"
    file.write_text("\n".join(lines))
    return file, len(lines)


def interact(robot: Peer, numbers: range) -> None:
    for n in numbers:
        if n % 10 == 1:
            robot.publish("/shift/task", {"task": "grasp" if n % 20 == 1 else "pour"})
            time.sleep(0.05)  # topics and services are different ways: the task must be there first
        decision = robot.decide()
        assert decision is not None
        assert decision["n"] == n
        assert decision["task"] == ("grasp" if (n - 1) % 20 < 10 else "pour")
        assert not decision["stale"]
        report = {"decision_id": decision["decision_id"], "comprehension": RESULT, "enabledness": RESULT}
        robot.publish("/shift/task_performance", report)


def wait_for(what: Callable[[], bool], wait_s: float = 20.0) -> None:
    until = time.monotonic() + wait_s
    while not what():
        assert time.monotonic() < until
        time.sleep(0.05)


def ended(mesh: LiveMesh, session: str) -> Path:
    answer = httpx.post(f"{mesh.url}/v1/sessions/{session}/end", timeout=30.0)
    assert answer.status_code == 200, answer.text
    return mesh.data / "recordings" / answer.json()["recording"]


def verified(recording: Path) -> dict[str, Any]:
    command = [sys.executable, "-m", "shift_cli.main", "verify", str(recording), "--json"]
    found = subprocess.run(command, capture_output=True, text=True, check=False)
    assert found.returncode == 0, found.stdout + found.stderr
    answer: dict[str, Any] = json.loads(found.stdout)
    return answer


@pytest.mark.parametrize("name", PEERS)
def test_hundred_interactions_with_real_gaze_lose_nothing(name: str, mesh: LiveMesh, tmp_path: Path) -> None:
    if name in REQUIREMENTS:
        python_of(name)
    session = f"hundred-{name}"
    file, count = gaze_lines(tmp_path, TRIALS)
    with (
        Bridge(mesh.zenoh, tmp_path, PEERS[name], session=session, study="coffee") as bridge,
        peer(name, bridge) as robot,
    ):
        for topic in ("decision", "observation", "estimate", "diagnostics"):
            robot.ask("hear", f"/shift/{topic}")
        robot.ask("advertise", "/shift/task")
        robot.ask("advertise", "/shift/task_performance")
        robot.ask("advertise", "/shift/gaze")
        robot.ask("service", "/shift/next_strategy")
        time.sleep(1.0)  # what is heard from the first on must be matched
        assert robot.ask("play", "/shift/gaze", str(file), RATE_HZ) == count
        interact(robot, range(1, INTERACTIONS + 1))
        wait_for(lambda: robot.ask("playing") == 0, 60.0)
        wait_for(lambda: robot.said("/shift/observation")[-1]["seen"]["performance"] == INTERACTIONS)
        assert robot.ask("wait_heard", "/shift/decision", INTERACTIONS, 10.0) == INTERACTIONS
        heard = robot.said("/shift/decision")
        assert [d["n"] for d in heard] == list(range(1, INTERACTIONS + 1))
        assert robot.said("/shift/estimate")
        newest = robot.said("/shift/observation")[-1]
        dropped = [d["dropped"] for d in robot.said("/shift/diagnostics")]
        time.sleep(0.5)  # the last chunk's deadline
    assert not any(dropped), dropped
    assert newest["gaze"]["dropped"] == 0
    recording = ended(mesh, session)
    topics: Counter[str] = Counter()
    recorded = []
    for fact in Recording(recording).facts():
        topics[fact.fact.subject] += 1
        if fact.fact.subject == "gaze":
            recorded += fact.fact.t  # type: ignore[attr-defined]
    assert topics["decision"] == topics["performance"] == INTERACTIONS
    assert recorded == [json.loads(line)["t"] for line in file.read_text().splitlines()]
    assert verified(recording)
