"""``shift-mesh up --workers``: every session in its own shard, through a kill, and never lost from view."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import httpx
import pytest
from shift_recording.mcap.reader import Recording
from shift_schemas.messages import Session
from shift_schemas.shards import shard_of
from shift_verify.verify import verify
from support.whole_mesh import LiveMesh, running_mesh

SESSIONS = tuple(f"P{n}" for n in range(8))
RESULT = {"success": True, "duration_s": 2.0}


def interact(http: httpx.Client, session: str, n: int) -> None:
    """Send gaze, make decision ``n`` and report its result."""
    t = [round(n + i / 100, 3) for i in range(10)]
    gaze = {"source": "eyes", "seq": n, "t": t, "x": [0.2] * 10, "y": [0.5] * 10}
    decision = {"task": "a", "decision_id": f"d{n}"}
    report = {"decision_id": f"d{n}", "comprehension": RESULT, "enabledness": RESULT}
    for path, body in (("gaze", gaze), ("decisions", decision), ("performance", report)):
        http.post(f"/v1/sessions/{session}/{path}", json=body).raise_for_status()


def test_sessions_of_three_shards_survive_a_kill_and_verify(tmp_path: Path) -> None:
    with running_mesh(tmp_path, "--workers", "3") as mesh, httpx.Client(base_url=mesh.url, timeout=30.0) as http:
        for session in SESSIONS:
            http.post("/v1/sessions", json={"participant": session, "session": session}).raise_for_status()
            interact(http, session, 0)
        os.kill(mesh.pids_of("shift_monitor")[0], signal.SIGKILL)
        for session in SESSIONS:
            interact(http, session, 1)
            http.post(f"/v1/sessions/{session}/end").raise_for_status()
        listed = http.get("/v1/sessions").json()["sessions"]
        assert {found["session"]: found["shard"] for found in listed} == {s: f"{shard_of(s, 3)}/3" for s in SESSIONS}
        assert len(http.get("/readyz").json()["services"]) == 3 * 4 + 1
        for session in SESSIONS:
            check_recording(mesh, session)


def check_recording(mesh: LiveMesh, session: str) -> None:
    """Check that everything acknowledged is recorded, and that the recording verifies."""
    path = mesh.data / "recordings" / f"{session}.mcap"
    report = verify(path)
    assert (report.ok, report.complete) == (True, True), report.difference
    assert (report.checked["gaze"], report.checked["decision"], report.checked["performance"]) == (2, 2, 2)
    first = next(Recording(path).facts(("session",))).fact
    assert isinstance(first, Session)
    assert first.shard == f"{shard_of(session, 3)}/3"


@pytest.mark.parametrize("workers", [1, 3])
def test_other_number_of_workers_is_refused_while_a_session_is_live(tmp_path: Path, workers: int) -> None:
    with running_mesh(tmp_path, "--workers", "2") as mesh:
        started = httpx.post(f"{mesh.url}/v1/sessions", json={"participant": "P1", "session": "s1"}, timeout=30.0)
        started.raise_for_status()
    line = [sys.executable, "-m", "shift_cli.main", "up", "--workers", str(workers), "--data", str(tmp_path / "data")]
    done = subprocess.run(line, capture_output=True, text=True, timeout=60)
    said = " ".join(done.stderr.split())
    assert done.returncode == 2, said
    assert "has a live session of a mesh with 2 shards: s1" in said
    assert "--workers 2" in said
