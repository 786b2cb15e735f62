"""``shift-mesh replay --inputs``: the mesh makes the recorded decisions again, in a session of its own."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from shift_recording.mcap.reader import facts
from shift_runtime.rest_client import RestClient
from shift_simulator.live import drive
from shift_simulator.users import paper_user
from shift_verify.verify import verify
from support.whole_mesh import LiveMesh

EPISODES = 12


@pytest.fixture(scope="module")
def recording(mesh: LiveMesh) -> Path:
    """A session with gaze, an override, a change of the study, a marker and a correction."""
    with RestClient(mesh.url) as shift:
        shift.start("P01", session="original", study="coffee", condition="adaptive", seed=11, covariates={"age": 30})
        for episode in drive(shift, "original", paper_user("B"), EPISODES // 2):
            last = episode.decision["decision_id"]
        shift.report("original", last, True, 4.0, False, 5.0, corrects=True)
        _patch(shift, "original", {"learner": {"epsilon": 0.5}, "capacity": {"recovery": 0.2}})
        _post(shift, "original", "markers", {"text": "a note"})
        strategy = {"negation": "negation", "hesitation": "none"}
        _post(shift, "original", "override", {"task": "grasp", "strategy": strategy, "reason": "to see"})
        list(drive(shift, "original", paper_user("B"), EPISODES // 2))
        shift.end("original")
    return mesh.data / "recordings" / "original.mcap"


def _post(shift: RestClient, session: str, path: str, body: dict[str, object]) -> None:
    shift._ask("POST", f"/v1/sessions/{session}/{path}", body)


def _patch(shift: RestClient, session: str, body: dict[str, object]) -> None:
    shift._ask("PATCH", f"/v1/sessions/{session}/config", body)


def replayed(mesh: LiveMesh, file: Path, session: str, *more: str) -> subprocess.CompletedProcess[str]:
    line = [sys.executable, "-m", "shift_cli.main", "replay", str(file), "--inputs", "--session", session]
    places = ["--url", mesh.url, "--zenoh", mesh.zenoh]
    return subprocess.run(
        [*line, *places, *more], stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=120, check=False
    )


@pytest.mark.parametrize("speed", ["20", "10000"])
def test_mesh_decides_the_same_again(mesh: LiveMesh, recording: Path, speed: str) -> None:
    session = f"again-{speed}"
    done = replayed(mesh, recording, session, "--speed", speed)
    assert done.returncode == 0, done.stderr
    assert f"{EPISODES} of {EPISODES} decisions are the recorded ones" in done.stdout
    with RestClient(mesh.url) as shift:
        shift.end(session)
    second = mesh.data / "recordings" / f"{session}.mcap"
    assert verify(second).ok
    for subject, fields in {
        "decision": ("strategy", "probabilities", "scores", "cognitive_state", "policy_source"),
        "performance": ("decision_id", "comprehension", "enabledness", "reward", "corrects"),
        "gaze": ("source", "seq", "t", "aoi", "x", "y"),
        "override": ("task", "strategy", "reason"),
    }.items():
        first, again = (
            [[getattr(r.fact, name) for name in fields] for r in facts(file) if r.fact.subject == subject]
            for file in (recording, second)
        )
        assert first, subject
        assert first == again, subject
    begun = next(r.fact for r in facts(second) if r.fact.subject == "session")
    assert begun.model_dump()["covariates"] == {"age": "30"}
    assert (begun.model_dump()["condition"], begun.model_dump()["seed"]) == ("adaptive", 11)


def test_options_that_leave_out_inputs_are_refused(mesh: LiveMesh, recording: Path) -> None:
    done = replayed(mesh, recording, "wrong", "--topics", "gaze", "--loop")
    assert done.returncode == 2
    assert "--topics, --loop cannot be used with --inputs" in done.stderr


def test_session_that_is_there_is_refused(mesh: LiveMesh, recording: Path) -> None:
    with RestClient(mesh.url) as shift:
        shift.start("P09", session="taken")
        done = replayed(mesh, recording, "taken")
        shift.end("taken")
    assert done.returncode == 2
    assert "taken" in done.stderr
    assert json.dumps("taken") not in done.stdout
