"""A service dies after its commit and before its reply, for every kind of command."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
from shift_runtime.rest_client import RestClient
from shift_schemas.messages import GazeChunk
from shift_simulator.live import LiveEpisode, drive
from shift_simulator.users import paper_user
from support.interactions import STUDY, check_recording, essences, expected, played
from support.whole_mesh import LiveMesh, running_mesh


@pytest.fixture(scope="module")
def mesh(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LiveMesh]:
    program = (str(Path(__file__).parents[1] / "support" / "dying_mesh.py"),)
    with running_mesh(tmp_path_factory.mktemp("dying"), program=program) as running:
        yield running


def wish(mesh: LiveMesh, service: str) -> Path:
    file = mesh.data / f"die-{service}"
    file.touch()
    return file


def test_whatever_reply_is_lost_the_repeat_gets_the_first_result_and_nothing_is_applied_twice(mesh: LiveMesh) -> None:
    with RestClient(mesh.url, patience_s=60.0) as shift:
        wishes = [wish(mesh, "recorder")]
        shift.start("P00", session="lost", study=STUDY, seed=7)
        done: list[LiveEpisode] = []
        for episode in drive(shift, "lost", paper_user("A"), 18):
            done.append(episode)
            if len(done) % 3 == 0 and len(done) < 18:
                wishes.append(wish(mesh, ("decider", "learner")[len(done) // 3 % 2]))
        wishes.append(wish(mesh, "monitor"))
        for _ in range(2):
            shift.gaze("lost", GazeChunk(source="eyes", seq=0, t=[0.0, 0.1], aoi=["left", None]))
        wishes.append(wish(mesh, "recorder"))
        mark = {"text": "noted", "marker_id": "m1"}
        for _ in range(2):
            answer = httpx.post(f"{mesh.url}/v1/sessions/lost/markers", json=mark, timeout=30.0)
            assert answer.status_code in (200, 201), answer.text
        wishes.append(wish(mesh, "recorder"))
        ended = shift.end("lost")
        assert shift.end("lost") == ended
    one = played(done, ended)
    assert [w.name for w in wishes if w.exists()] == []
    assert essences(one) == expected(7, 18)
    messages = check_recording(mesh, one)
    assert [m["text"] for m in messages["marker"]] == ["noted"]
    assert [g["seq"] for g in messages["gaze"] if g["source"] == "eyes"] == [0]
    assert len(messages["session"]) == 3
    assert mesh.log.read_text().count("was ended by SIGKILL") == len(wishes)
