"""Ends that are interrupted: a disk that is full while the recording is merged, a segment that was cut.

What was decided once, such as the time of the end, is written from there by every attempt: each recording verifies.
"""

from __future__ import annotations

import json
import os
import time
from pathlib import Path

import httpx
import pytest
from shift_recording.mcap.reader import Recording
from shift_runtime.rest_client import RestClient
from shift_schemas.messages import GazeChunk
from shift_verify.verify import verify
from support.interactions import STUDY
from support.small_disk import AS_ROOT, fill, small_disk
from support.whole_mesh import LiveMesh, running_mesh

ROOM_LEFT_KB = (0, 100, 200, 400)
"""What the disk has left when the end is asked for: each stops the merge at another place."""


def gaze(shift: RestClient, session: str, chunks: int, samples: int) -> int:
    """Send gaze that hardly compresses, and return the number of acknowledged samples."""
    accepted = 0
    for seq in range(chunks):
        t = [seq * samples / 300 + i / 300 for i in range(samples)]
        x = [(i * 7919 + seq * 104729) % 99991 / 99991 for i in range(samples)]
        accepted += shift.gaze(session, GazeChunk(source="a", seq=seq, t=t, x=x, y=x[::-1]))["accepted"]
    return accepted


def check(mesh: LiveMesh, session: str, samples: int, decisions: int) -> None:
    """Check that everything acknowledged is recorded, and that the recording verifies."""
    path = mesh.data / "recordings" / f"{session}.mcap"
    report = verify(path)
    assert (report.ok, report.complete) == (True, True), report.difference
    recorded = [json.loads(message.data) for message in Recording(path).messages({"gaze"})]
    assert sum(len(gaze["t"]) for gaze in recorded) == samples
    assert sum(1 for _ in Recording(path).messages({"decision"})) == decisions


@AS_ROOT
def test_a_disk_that_is_full_while_a_recording_is_finished_leaves_one_that_verifies(tmp_path: Path) -> None:
    data = tmp_path / "data"
    with small_disk(data, 160), running_mesh(tmp_path) as mesh, RestClient(mesh.url, patience_s=60.0) as shift:
        refused = 0
        for room_kb in ROOM_LEFT_KB:
            session = f"room-{room_kb}"
            shift.start("P00", session=session, study=STUDY, seed=7)
            samples = gaze(shift, session, chunks=30, samples=600)
            shift.decide(session, "a")
            time.sleep(1.5)  # a flush, so that the segment itself is on the disk
            ballast = data / "ballast"
            fill(ballast)
            os.truncate(ballast, max(ballast.stat().st_size - room_kb * 1024, 0))
            answer = httpx.post(f"{mesh.url}/v1/sessions/{session}/end", timeout=60.0)
            assert answer.status_code in (200, 503)
            refused += answer.status_code == 503
            ballast.unlink()
            mesh.until(lambda: mesh.ready()["ready"])
            shift.end(session)
            check(mesh, session, samples, 1)
        assert refused >= 2


@pytest.mark.parametrize("cut", [200, 1000, 5000])
def test_a_live_segment_that_was_cut_is_read_again_from_the_journals(tmp_path: Path, cut: int) -> None:
    with running_mesh(tmp_path) as mesh, RestClient(mesh.url, patience_s=60.0) as shift:
        shift.start("P00", session="cut", study=STUDY, seed=7)
        samples = gaze(shift, "cut", chunks=8, samples=200)
        shift.decide("cut", "a")
        time.sleep(1.5)
        (segment,) = (mesh.data / "segments" / "cut").glob("*.mcap")
        mesh.kill("shift_recorder")
        os.truncate(segment, segment.stat().st_size - cut)
        mesh.wait_ready()
        shift.decide("cut", "b")
        shift.end("cut")
        check(mesh, "cut", samples, 2)
