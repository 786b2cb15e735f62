"""Faults at the start and on the disk: no services yet, a full disk, a folder that cannot be written."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import httpx
import pytest
from shift_runtime.rest_client import RestClient
from shift_schemas.errors import Unavailable
from shift_simulator.live import LiveEpisode, drive
from shift_simulator.users import paper_user
from support.free_ports import free_port
from support.interactions import STUDY, check_recording, essences, expected, interact, played
from support.small_disk import AS_ROOT, fill, small_disk
from support.whole_mesh import READY_WITHIN_S, LiveMesh, running_mesh

SERVICES = ("gateway", "learner", "decider", "monitor", "recorder")


def waited(there: Any) -> Any:
    end = time.monotonic() + READY_WITHIN_S
    while not (found := there()):
        assert time.monotonic() < end
        time.sleep(0.02)
    return found


# --- row 10 ---


@contextmanager
def process(module: str, folder: Path, **environment: str) -> Iterator[subprocess.Popen[bytes]]:
    with open(folder / f"{module}.log", "ab") as log:
        running = subprocess.Popen(
            [sys.executable, "-m", module], cwd=folder, env={**os.environ, **environment}, stderr=log, stdout=log
        )
    try:
        yield running
    finally:
        running.terminate()
        try:
            code = running.wait(30)
        finally:
            running.kill()
        assert code == 0, (folder / f"{module}.log").read_text()


@pytest.mark.parametrize("order", [SERVICES, tuple(reversed(SERVICES))], ids=["gateway first", "recorder first"])
def test_row_10_services_wait_for_the_router_say_so_and_work_once_it_comes(
    tmp_path: Path, order: tuple[str, ...]
) -> None:
    port, zenoh = free_port(), f"tcp/127.0.0.1:{free_port()}"
    environment = {
        "SHIFT_ZENOH": zenoh, "SHIFT_ROUTER_LISTEN": zenoh, "SHIFT_PORT": str(port),
        "SHIFT_DATA": str(tmp_path / "data"),
    }  # fmt: skip

    def ready() -> Any:
        try:
            return httpx.get(f"http://127.0.0.1:{port}/readyz", timeout=10.0).json()
        except httpx.HTTPError:
            return None

    with ExitStack() as stack:
        running = [stack.enter_context(process(f"shift_{name}", tmp_path, **environment)) for name in order]
        waiting = waited(ready)
        assert waiting["ready"] is False
        assert set(waiting["missing"]) == {*SERVICES}
        assert waiting["services"]["gateway"].startswith("waits for the ")
        with RestClient(f"http://127.0.0.1:{port}", patience_s=0.1) as shift, pytest.raises(Unavailable):
            shift.session("s1")
        assert all(p.poll() is None for p in running)
        running.append(stack.enter_context(process("shift_runtime.router", tmp_path, **environment)))
        waited(lambda: (found := ready()) and found["ready"])
        mesh = LiveMesh(running[0], port, zenoh, tmp_path / "data", tmp_path / "log")
        done = interact(mesh, "s1", 7, 5)
        assert essences(done) == expected(7, 5)
        check_recording(mesh, done)


# --- rows 11 and 12 ---


@AS_ROOT
def test_row_11_a_disk_that_fills_up_refuses_and_goes_on_exactly_once_there_is_room(tmp_path: Path) -> None:
    data = tmp_path / "data"
    with small_disk(data, 80), running_mesh(tmp_path) as mesh, RestClient(mesh.url, patience_s=60.0) as shift:
        shift.start("P00", session="full", study=STUDY, seed=7)
        done: list[LiveEpisode] = list(drive(shift, "full", paper_user("A"), 10))
        ballast = data / "ballast"
        fill(ballast)
        refused = _refusal(mesh)
        assert refused.status_code == 503
        assert "cannot write its journal" in refused.json()["detail"]
        begun = time.monotonic()
        mesh.until(lambda: not mesh.ready()["ready"])
        said = [s for s in mesh.ready()["services"].values() if "cannot" in s]
        assert said
        print(f"\ndisk full: alarm in /readyz after {time.monotonic() - begun:.2f} s: {said[0]}")
        ballast.unlink()
        mesh.until(lambda: mesh.ready()["ready"])
        done += list(drive(shift, "full", paper_user("A"), 10))
        one = played(done, shift.end("full"))
        check_recording(mesh, one)
        assert [e["n"] for e in essences(one)] == list(range(1, 21))
        counts = one.ended["counts"]
        assert (counts["decision"], counts["performance"], counts["transition"]) == (20, 20, 20)
        assert mesh.log.read_text().count("was ended by") == 0
        assert mesh.stop() == 0


def _refusal(mesh: LiveMesh) -> httpx.Response:
    """Send markers until one is refused: the journal accepts them while its file has room."""
    for n in range(2000):
        body = {"text": "x" * 2000, "marker_id": f"m{n}"}
        answer = httpx.post(f"{mesh.url}/v1/sessions/full/markers", json=body, timeout=30.0)
        if answer.status_code != 201:
            return answer
        fill(mesh.data / "ballast-2")
    raise AssertionError("the disk was never full")


@AS_ROOT
def test_row_12_no_session_starts_where_its_recording_cannot_be_written(tmp_path: Path) -> None:
    recordings = tmp_path / "data" / "recordings"
    with running_mesh(tmp_path) as mesh:
        with small_disk(recordings, 2):
            assert f"{recordings} has 2 MB left; no session starts below 64 MB" in _start(mesh)
        with small_disk(recordings, 100):
            subprocess.run(["mount", "-o", "remount,ro", recordings], check=True)
            said = _start(mesh)
            assert f"the recorder must not write to {recordings}: the folder is read-only" in said
        done = interact(mesh, "s1", 7, 3)
        check_recording(mesh, done)


def _start(mesh: LiveMesh) -> str:
    """Start a session, and return the sentence of the refusal."""
    answer = httpx.post(f"{mesh.url}/v1/sessions", json={"participant": "P1", "session": "s1"}, timeout=30.0)
    assert answer.status_code == 503
    assert answer.headers["content-type"] == "application/problem+json"
    return str(answer.json()["detail"])
