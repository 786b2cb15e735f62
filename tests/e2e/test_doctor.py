"""``shift-mesh doctor``: is everything reachable, and if not, why."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

import pytest
import zenoh
from shift_runtime.bus.zenoh_config import zenoh_config
from support.free_ports import free_port
from support.whole_mesh import LiveMesh

SERVICES = {"recorder", "monitor", "decider", "learner", "gateway"}


def doctor(*flags: str) -> subprocess.CompletedProcess[str]:
    line = [sys.executable, "-m", "shift_cli.main", "doctor", *flags]
    done = subprocess.run(line, capture_output=True, text=True, timeout=60, env={**os.environ, "COLUMNS": "200"})
    assert "Traceback" not in done.stderr
    return done


def flags_of(mesh: LiveMesh) -> tuple[str, ...]:
    return ("--url", mesh.url, "--zenoh", mesh.zenoh, "--data", str(mesh.data))


def test_a_mesh_that_runs_is_fine(mesh: LiveMesh) -> None:
    done = doctor(*flags_of(mesh))
    assert done.returncode == 0
    for what in (*SERVICES, "router", "data folder"):
        assert any(what in line and "ok" in line for line in done.stdout.splitlines()), what
    assert " no " not in done.stdout


def test_json_is_one_document(mesh: LiveMesh) -> None:
    done = doctor(*flags_of(mesh), "--json")
    assert done.returncode == 0
    found = json.loads(done.stdout)
    assert found["fine"] is True
    assert {f["what"] for f in found["findings"]} == {*SERVICES, "router", "data folder"}
    assert all(f["fine"] for f in found["findings"])
    assert done.stderr == ""


def test_a_hung_service_is_named(mesh: LiveMesh) -> None:
    pid = mesh.pid_of("shift_learner")
    os.kill(pid, signal.SIGSTOP)
    try:
        done = doctor(*flags_of(mesh), "--json")
    finally:
        os.kill(pid, signal.SIGCONT)
    assert done.returncode == 1
    bad = {f["what"]: f["detail"] for f in json.loads(done.stdout)["findings"] if not f["fine"]}
    assert bad["learner"] == "does not answer"
    mesh.until(lambda: mesh.ready()["ready"])


def test_without_a_mesh_it_says_why_and_what_to_do(tmp_path: Path) -> None:
    nowhere = ("--url", f"http://127.0.0.1:{free_port()}", "--zenoh", f"tcp/127.0.0.1:{free_port()}")
    done = doctor(*nowhere, "--data", str(tmp_path / "data"))
    assert done.returncode == 1
    assert "no gateway answers at" in done.stdout
    assert "shift-mesh up" in done.stdout
    found = json.loads(doctor(*nowhere, "--data", str(tmp_path / "data"), "--json").stdout)
    assert found["fine"] is False
    assert {f["what"]: f["fine"] for f in found["findings"]} == {
        "router": False,
        "gateway": False,
        "data folder": False,
    }


@pytest.fixture(params=[b"<html>It works</html>", b'{"detail": "Not Found"}', b"[]"])
def another_server(request: pytest.FixtureRequest) -> Iterator[str]:
    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("Content-Length", str(len(request.param)))
            self.end_headers()
            self.wfile.write(request.param)

        def log_message(self, format: str, *args: object) -> None:
            pass

    server = HTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=server.serve_forever, args=(0.01,))
    thread.start()
    yield f"http://127.0.0.1:{server.server_address[1]}"
    server.shutdown()
    server.server_close()
    thread.join()


def test_another_server_on_the_gateway_s_port_is_told_apart(mesh: LiveMesh, another_server: str) -> None:
    done = doctor("--url", another_server, "--zenoh", mesh.zenoh, "--data", str(mesh.data), "--json")
    assert done.returncode == 1
    bad = [f for f in json.loads(done.stdout)["findings"] if not f["fine"]]
    assert [f["what"] for f in bad] == ["gateway"]
    assert f"the server at {another_server} is no" in bad[0]["detail"]


@pytest.mark.parametrize("endpoint", ["nonsense", "tcp/127.0.0.1:x", "tcp/"])
def test_an_endpoint_that_is_none_is_a_finding(mesh: LiveMesh, endpoint: str) -> None:
    done = doctor("--url", mesh.url, "--zenoh", endpoint, "--data", str(mesh.data))
    assert done.returncode == 1


def test_gaze_topic_of_a_ros_graph_is_found_with_how_to_connect_it(mesh: LiveMesh) -> None:
    token = "@ros2_lv/0/zid/0/10/MP/%/%/tracker/%humans%gaze/hri_msgs::msg::dds_::Gaze_/RIHS01_1/::,10:,:,:,,"
    with zenoh.open(zenoh_config("client", connect=mesh.zenoh)) as session:
        held = session.liveliness().declare_token(token)
        done = doctor(*flags_of(mesh), "--json")
        held.undeclare()
    assert "ROS 2 topic /humans/gaze (hri_msgs/msg/Gaze)" in [s["what"] for s in json.loads(done.stdout)["sources"]]
