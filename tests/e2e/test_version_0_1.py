"""What version 0.1 recorded verifies as it did, and a data folder of it opens and goes on."""

from __future__ import annotations

import tarfile
from pathlib import Path

import httpx
import pytest
from shift_recording.mcap.reader import Recording
from shift_runtime.rest_client import RestClient
from shift_schemas.messages import GazeChunk
from shift_verify.verify import verify
from support.whole_mesh import running_mesh

KEPT = Path(__file__).parents[1] / "data" / "v0.1"
RECORDINGS = sorted(KEPT.glob("*.mcap"))


def test_ten_recordings_are_kept() -> None:
    assert len(RECORDINGS) == 10


@pytest.mark.parametrize("recording", RECORDINGS, ids=lambda path: path.stem)
def test_a_recording_of_version_0_1_verifies(recording: Path) -> None:
    report = verify(recording)
    assert (report.ok, report.complete, report.checksum) == (True, True, "matches"), report.difference
    counts = dict.fromkeys(report.checked, 0)
    for message in Recording(recording).messages():
        counts[message.topic] = counts.get(message.topic, 0) + 1
    assert report.checked == counts, "every message of it was derived again"


def test_a_data_folder_of_version_0_1_opens_and_its_live_session_goes_on(tmp_path: Path) -> None:
    with tarfile.open(KEPT / "data-folder.tar.xz") as archive:
        archive.extractall(tmp_path, filter="data")
    with running_mesh(tmp_path) as mesh, RestClient(mesh.url, patience_s=60.0) as shift:
        sessions = {s["session"]: s for s in httpx.get(f"{mesh.url}/v1/sessions", timeout=30.0).json()["sessions"]}
        assert len(sessions) == 11
        assert {s: v["state"] for s, v in sessions.items() if v["state"] != "ended"} == {"goes-on": "live"}
        before = shift.observation("goes-on")["gaze"]
        assert before["fixations"] >= 0
        for seq in range(4, 10):  # a repeat of what was sent to the old version, then what is new
            t = [round(seq * 0.5 + i / 60, 6) for i in range(30)]
            chunk = GazeChunk(source="tx", seq=seq, t=t, x=[0.9] * 30, y=[0.5] * 30)
            assert shift.gaze("goes-on", chunk)["accepted"] == 30
        old = GazeChunk(
            source="tx", seq=1, t=[round(0.5 + i / 60, 6) for i in range(30)],
            x=[round(0.5 + 0.002 * (i % 5), 4) for i in range(30)], y=[0.5] * 30,
        )  # fmt: skip
        counted = shift.session("goes-on")["counts"]["gaze"]
        assert shift.gaze("goes-on", old)["accepted"] == 30
        assert shift.session("goes-on")["counts"]["gaze"] == counted, "a chunk that the old version has is a repeat"
        decision = shift.decide("goes-on", "a", "d2")
        assert (decision["policy_source"], decision["n"]) == ("override", 2)
        assert shift.report("goes-on", "d2", True, 4.0, True, 5.0)["cumulative_reward"] != 0
        assert shift.observation("goes-on")["gaze"]["aoi"] == "right"
        shift.end("goes-on")
        report = verify(mesh.data / "recordings" / "goes-on.mcap")
        assert (report.ok, report.complete) == (True, True), report.difference
        shift.start("P02", session="new-one")
        shift.end("new-one")
        assert verify(mesh.data / "recordings" / "new-one.mcap").ok
