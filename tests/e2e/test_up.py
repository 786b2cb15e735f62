"""``shift-mesh up``: one command up, one signal down, and what it says when it cannot."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import httpx
import pytest
from shift_cli.supervisor import STEADY_S
from shift_runtime.rest_client import RestClient
from shift_simulator.live import drive
from shift_simulator.users import paper_user
from support.free_ports import free_port
from support.interactions import essence, expected, read_recording
from support.whole_mesh import LiveMesh, running_mesh

PACKAGES = ("monitor", "decider", "learner", "recorder", "gateway", "runtime.router")
STUDY = {"study": "lives", "interactions": 100, "decider": {"wait_s": 30}}


def pids(mesh: LiveMesh) -> dict[str, int]:
    return {package: mesh.pid_of(f"shift_{package}") for package in PACKAGES}


def gone(pid: int) -> bool:
    """Return whether the process has ended; its new parent may not have reaped it yet."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] == "Z"
    except OSError:
        return True


def with_checksum(path: Path) -> bool:
    checked = subprocess.run(["sha256sum", "--check", "--quiet", f"{path.name}.sha256"], cwd=path.parent)
    return checked.returncode == 0


def test_each_life_ends_cleanly_with_its_recording_and_the_next_goes_on_from_there(tmp_path: Path) -> None:
    decisions = []
    for life, number in enumerate((signal.SIGINT, signal.SIGTERM, signal.SIGTERM), 1):
        with running_mesh(tmp_path) as mesh, RestClient(mesh.url) as shift:
            before = pids(mesh)
            if life == 1:
                shift.start("P00", session="lives", study=STUDY, seed=7)
            decisions += [episode.decision for episode in drive(shift, "lives", paper_user("A"), 5)]
            if life == 3:
                ended = shift.end("lives")
            assert mesh.stop(number) == 0
            assert all(gone(pid) for pid in before.values())
        recording = mesh.data / "recordings" / "lives.mcap"
        assert with_checksum(recording)
        messages = read_recording(recording)
        assert [d["n"] for d in messages["decision"]] == list(range(1, 5 * life + 1))
        assert len(messages["performance"]) == len(messages["transition"]) == 5 * life
    assert [essence(d) for d in decisions] == [
        {k: v for k, v in e.items() if k != "reward"} for e in expected(7, 15, STUDY)
    ]
    assert {topic: len(found) for topic, found in messages.items()} == ended["counts"]
    log = mesh.log.read_text()
    assert "SIGINT: stopping" in log
    assert log.count("stopped\n") >= 3
    assert "Traceback" not in log


def test_a_service_that_dies_is_started_again_and_it_is_said(tmp_path: Path) -> None:
    with running_mesh(tmp_path) as mesh:
        killed = mesh.kill("shift_monitor")
        mesh.until(lambda: "the monitor was ended by SIGKILL; it starts again" in mesh.log.read_text())
        mesh.until(lambda: mesh.ready()["ready"])
        assert mesh.pid_of("shift_monitor") != killed


def test_a_mesh_that_was_suspended_goes_on(tmp_path: Path) -> None:
    """Ctrl-Z and fg, or a container that was paused."""
    with running_mesh(tmp_path) as mesh:
        for pause_s in (0.05, 0.3):
            mesh.process.send_signal(signal.SIGSTOP)
            time.sleep(pause_s)
            mesh.process.send_signal(signal.SIGCONT)
            time.sleep(0.2)
        assert mesh.process.poll() is None
        assert mesh.ready()["ready"]
        assert mesh.stop(signal.SIGINT) == 0


def test_with_the_supervisor_its_services_go_and_leave_whole_recordings(tmp_path: Path) -> None:
    with running_mesh(tmp_path) as mesh, RestClient(mesh.url) as shift:
        before = pids(mesh)
        shift.start("P00", session="orphan", study=STUDY, seed=7)
        list(drive(shift, "orphan", paper_user("A"), 5))
        mesh.process.send_signal(signal.SIGKILL)
        assert mesh.process.wait(30) == -signal.SIGKILL
        mesh.until(lambda: all(gone(pid) for pid in before.values()))
        messages = read_recording(mesh.data / "recordings" / "orphan.mcap")
        assert len(messages["transition"]) == 5
    with running_mesh(tmp_path) as mesh, RestClient(mesh.url) as shift:
        list(drive(shift, "orphan", paper_user("A"), 5))
        assert shift.end("orphan")["counts"]["decision"] == 10


def test_demo_makes_a_session_with_a_person_in_it(tmp_path: Path) -> None:
    with running_mesh(tmp_path, "--demo") as mesh, RestClient(mesh.url) as shift:

        def interacts() -> bool:
            sessions = httpx.get(f"{mesh.url}/v1/sessions").json()["sessions"]
            return [s["session"] for s in sessions] == ["demo"] and sessions[0]["counts"].get("performance", 0) >= 2

        mesh.until(interacts)
        shift.end("demo")
        mesh.until(lambda: "demo-2" in httpx.get(f"{mesh.url}/v1/sessions").text)
        simulator = mesh.pid_of("shift_simulator")
        assert mesh.stop() == 0
        assert gone(simulator)
    assert read_recording(mesh.data / "recordings" / "demo.mcap")["transition"]
    assert "open http://127.0.0.1:" in mesh.log.read_text()


# --- what it refuses ---


def refused(folder: Path, *flags: str, **environment: str) -> str:
    """Check that ``up`` ends at once with exit code 2, and return its message."""
    given = [] if "--port" in flags else ["--port", str(free_port())]
    given += [] if "--zenoh" in flags else ["--zenoh", f"tcp/127.0.0.1:{free_port()}"]
    given += [] if "--data" in flags else ["--data", str(folder / "another")]
    done = subprocess.run(
        [sys.executable, "-m", "shift_cli.main", "up", *given, *flags],
        capture_output=True, text=True, timeout=60, cwd=folder, env={**os.environ, **environment},
    )  # fmt: skip
    assert done.returncode == 2, done.stderr
    assert "Traceback" not in done.stderr
    return " ".join(done.stderr.split())


def test_a_second_mesh_on_the_same_folder_port_or_endpoint_is_refused(tmp_path: Path) -> None:
    with running_mesh(tmp_path) as mesh:
        assert f"another mesh uses {mesh.data}; stop it, or give another folder with --data" in refused(
            tmp_path, "--data", str(mesh.data)
        )
        said = refused(tmp_path, "--port", str(mesh.port))
        assert f"port 127.0.0.1:{mesh.port} cannot be used: Address already in use; choose another with --port" in said
        assert "choose another with --zenoh" in refused(tmp_path, "--zenoh", mesh.zenoh)
        assert mesh.ready()["ready"]
        assert mesh.stop() == 0


@pytest.mark.parametrize("endpoint", ["nonsense", "tcp/127.0.0.1", "tcp/127.0.0.1:x", "smoke/127.0.0.1:7447"])
def test_an_endpoint_that_is_none_is_refused(tmp_path: Path, endpoint: str) -> None:
    assert f"--zenoh is '{endpoint}': an endpoint is PROTOCOL/HOST:PORT" in refused(tmp_path, "--zenoh", endpoint)


def test_a_data_folder_that_cannot_be_one_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    assert "give another folder with --data" in refused(tmp_path, "--data", str(tmp_path / "file"))


def test_an_address_that_is_not_ours_is_refused(tmp_path: Path) -> None:
    assert "choose another with --port" in refused(tmp_path, "--host", "192.0.2.1")


@pytest.mark.parametrize(
    ("name", "value", "starts"),
    [("SHIFT_PATIENCE_S", "soon", True), ("SHIFT_LISTEN", "nonsense", False), ("SHIFT_LOG_JSON", "perhaps", False)],
)
def test_a_setting_with_a_mistake_is_named_once_and_stops_the_mesh(
    tmp_path: Path, name: str, value: str, starts: bool
) -> None:
    """What every service reads is looked at before anything starts, a service's own by the service."""
    said = refused(tmp_path, **{name: value})
    assert said.count(f"{name} is '{value}'") == 1
    assert ("cannot run with these settings; stopping" in said) == starts


def test_a_flag_with_a_mistake_is_named(tmp_path: Path) -> None:
    assert "--port" in refused(tmp_path, "--port", "99999")


def test_the_mesh_uses_a_router_that_runs_already(tmp_path: Path) -> None:
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    router = subprocess.Popen(
        [sys.executable, "-m", "shift_runtime.router"],
        env={**os.environ, "SHIFT_ROUTER_LISTEN": endpoint}, stderr=subprocess.PIPE,
    )  # fmt: skip
    try:
        assert router.stderr is not None
        assert endpoint.encode() in router.stderr.readline()
        with running_mesh(tmp_path, "--router", endpoint) as mesh, RestClient(mesh.url) as shift:
            shift.start("P00", session="s1", study=STUDY, seed=7)
            assert len(list(drive(shift, "s1", paper_user("A"), 3))) == 3
            assert mesh.stop() == 0
        router.terminate()
        assert router.wait(30) == 0
    finally:
        router.kill()
        router.wait()
        router.stderr.close()


def test_a_router_whose_endpoint_is_taken_says_so(tmp_path: Path) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        endpoint = f"tcp/127.0.0.1:{taken.getsockname()[1]}"
        done = subprocess.run(
            [sys.executable, "-m", "shift_runtime.router"],
            env={**os.environ, "SHIFT_ROUTER_LISTEN": endpoint}, capture_output=True, text=True, timeout=60,
        )  # fmt: skip
    assert done.returncode != 0
    assert f"the router cannot listen on {endpoint}" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_service_that_ran_and_then_cannot_open_its_journal_is_tried_again(tmp_path: Path) -> None:
    """Exit code 2 at the first start stops the mesh; later it is a trouble that may pass."""
    with running_mesh(tmp_path) as mesh:
        steady = time.monotonic() + STEADY_S
        mesh.until(lambda: time.monotonic() > steady)
        state = mesh.data / "state"
        os.kill(mesh.pid_of("shift_learner"), signal.SIGSTOP)  # it does not come back between the next two steps
        kept = [(path, path.rename(state / f"away-{path.name}")) for path in state.glob("learner.*")]
        (state / "learner.sqlite").mkdir()
        mesh.kill("shift_learner")
        mesh.until(lambda: "ended with exit code 2" in mesh.log.read_text())
        (state / "learner.sqlite").rmdir()
        for path, away in kept:
            away.rename(path)
        mesh.wait_ready()
        assert mesh.process.poll() is None
