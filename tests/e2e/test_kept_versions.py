"""Recordings of earlier versions verify as they did, and data folders of them open and go on."""

from __future__ import annotations

import tarfile
from pathlib import Path

import httpx
import pytest
from shift_recording.mcap.reader import Recording
from shift_runtime.rest_client import RestClient
from shift_schemas.messages import GazeChunk, Session
from shift_verify.verify import verify
from support.whole_mesh import running_mesh

KEPT = Path(__file__).parents[1] / "data"
FORMATS = {"v0.1": 1, "v0.2": 2, "format-5": 5}
"""The kept versions, each with the format that its sessions record."""
COUNTS = {"v0.1": 10, "v0.2": 10, "format-5": 4}
RECORDINGS = {version: sorted((KEPT / version).glob("*.mcap")) for version in FORMATS}


@pytest.mark.parametrize("version", FORMATS)
def test_recordings_of_each_version_are_kept_in_its_own_format(version: str) -> None:
    assert len(RECORDINGS[version]) == COUNTS[version]
    for recording in RECORDINGS[version]:
        facts = [recorded.fact for recorded in Recording(recording).facts(["session"])]
        formats = [fact.format for fact in facts if isinstance(fact, Session)]
        assert formats == [FORMATS[version]] * 3, f"{recording.stem}: it began, was ending and ended"


@pytest.mark.parametrize(
    "recording",
    [pytest.param(path, id=f"{version}-{path.stem}") for version, paths in RECORDINGS.items() for path in paths],
)
def test_a_recording_of_an_earlier_version_verifies(recording: Path) -> None:
    report = verify(recording)
    assert (report.ok, report.complete, report.checksum) == (True, True, "matches"), report.difference
    counts = dict.fromkeys(report.checked, 0)
    for message in Recording(recording).messages():
        counts[message.topic] = counts.get(message.topic, 0) + 1
    assert report.checked == counts, "every message of it was derived again"


@pytest.mark.parametrize("version", FORMATS)
def test_a_data_folder_of_an_earlier_version_opens_and_its_live_session_goes_on(version: str, tmp_path: Path) -> None:
    with tarfile.open(KEPT / version / "data-folder.tar.xz") as archive:
        archive.extractall(tmp_path, filter="data")
    with running_mesh(tmp_path) as mesh, RestClient(mesh.url, patience_s=60.0) as shift:
        sessions = {s["session"]: s for s in httpx.get(f"{mesh.url}/v1/sessions", timeout=30.0).json()["sessions"]}
        assert sessions.keys() == {"goes-on", *(path.stem for path in RECORDINGS[version])}
        assert {s: v["state"] for s, v in sessions.items() if v["state"] != "ended"} == {"goes-on": "live"}
        before = shift.observation("goes-on")["gaze"]
        assert before["fixations"] >= 0
        for seq in range(4, 10):  # chunks 0 to 3 were sent then
            t = [round(seq * 0.5 + i / 60, 6) for i in range(30)]
            chunk = GazeChunk(source="tx", seq=seq, t=t, x=[0.9] * 30, y=[0.5] * 30)
            assert shift.gaze("goes-on", chunk)["accepted"] == 30
        old = GazeChunk(
            source="tx", seq=1, t=[round(0.5 + i / 60, 6) for i in range(30)],
            x=[round(0.5 + 0.002 * (i % 5), 4) for i in range(30)], y=[0.5] * 30,
        )  # fmt: skip
        counted = shift.session("goes-on")["counts"]["gaze"]
        assert shift.gaze("goes-on", old)["accepted"] == 30
        assert shift.session("goes-on")["counts"]["gaze"] == counted, "a chunk that it took then is a repeat"
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
