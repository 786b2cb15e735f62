"""The mesh as it is run in containers: rights, a session through kills and a stop, the recording at the end."""

from __future__ import annotations

import hashlib
import io
import json
import time
from typing import Any

import httpx
import pytest
from mcap.reader import make_reader
from support.container_stack import SERVICES, Stack

pytestmark = [pytest.mark.containers, pytest.mark.timeout(1200)]

PATIENCE_S = 60.0
SUCCESS = {"success": True, "duration_s": 5.0}


class Tour:
    """One session through the gateway's door. Each command carries an id, so that it can be repeated."""

    def __init__(self, url: str, session: str) -> None:
        self.client = httpx.Client(base_url=url, timeout=10.0)
        self.path = f"/v1/sessions/{session}"
        self.session = session
        self.n = 0

    def ask(self, method: str, path: str, body: dict[str, Any] | None = None) -> dict[str, Any]:
        """Return the answer; repeat the request while a service is away, as a robot's program would."""
        deadline = time.monotonic() + PATIENCE_S
        while True:
            try:
                answer = self.client.request(method, path, json=body)
                if answer.status_code != 503:
                    break
                said = answer.text
            except httpx.TransportError as e:
                said = repr(e)
            assert time.monotonic() < deadline, f"{method} {path}: {said}"
            time.sleep(0.2)
        assert answer.is_success, f"{method} {path}: {answer.status_code} {answer.text}"
        return dict(answer.json())

    def start(self) -> None:
        body = {"participant": "P01", "session": self.session, "study": "coffee", "seed": 7}
        assert self.ask("POST", "/v1/sessions", body)["state"] == "live"

    def interaction(self) -> None:
        """Send gaze, a decision and its result, and wait for the model that has seen both."""
        self.n += 1
        times = [self.n + 0.1 * i for i in range(10)]
        gaze = {"source": "camera", "seq": self.n - 1, "t": times, "aoi": ["robot"] * 10}
        assert self.ask("POST", f"{self.path}/gaze", gaze) == {"accepted": 10}
        decision_id = f"d{self.n}"
        decision = self.ask("POST", f"{self.path}/decisions", {"task": "grasp", "decision_id": decision_id})
        assert (decision["n"], decision["session"]) == (self.n, self.session)
        result = {"decision_id": decision_id, "comprehension": SUCCESS, "enabledness": SUCCESS}
        self.ask("POST", f"{self.path}/performance", result)
        seen = self.ask("GET", f"{self.path}/observation")["seen"]
        assert (seen["decision"], seen["performance"]) == (self.n, self.n)


def test_everything_is_healthy_soon(stack: Stack, capsys: pytest.CaptureFixture[str]) -> None:
    with capsys.disabled():
        print(f"\n[containers] image {stack.build_s:.0f} s, up and healthy {stack.up_s:.1f} s (20 s wanted)")
    assert stack.up_s < 90.0


@pytest.mark.parametrize("service", SERVICES)
def test_process_has_no_rights(stack: Stack, service: str) -> None:
    text = stack.python(service, "print(open('/proc/1/status').read())")
    status = dict(line.split(":\t", 1) for line in text.splitlines())
    assert status["Uid"].split() == ["1000"] * 4
    assert {int(status[kind], 16) for kind in ("CapPrm", "CapEff", "CapBnd", "CapInh", "CapAmb")} == {0}
    assert status["NoNewPrivs"] == "1"


@pytest.mark.parametrize("service", SERVICES)
def test_root_file_system_is_read_only_even_for_root(stack: Stack, service: str) -> None:
    code = "import errno\ntry: open('/probe', 'w')\nexcept OSError as e: print(errno.errorcode[e.errno])"
    assert stack.python(service, code, "--user", "0") == "EROFS"


def test_gateway_alone_has_a_port_and_on_this_machine_only(stack: Stack) -> None:
    ports = {s: stack.inspect(s)["HostConfig"]["PortBindings"] or {} for s in SERVICES}
    gateway = ports.pop("gateway")
    assert gateway == {"8080/tcp": [{"HostIp": "127.0.0.1", "HostPort": str(stack.port)}]}
    assert not any(ports.values())


def test_a_simulated_person_is_in_session_demo(stack: Stack) -> None:
    tour = Tour(stack.url, "demo")
    deadline = time.monotonic() + PATIENCE_S
    while tour.ask("GET", tour.path)["counts"].get("performance", 0) == 0:
        assert time.monotonic() < deadline
        time.sleep(0.2)


def test_session_lives_through_kills_and_a_stop(stack: Stack, capsys: pytest.CaptureFixture[str]) -> None:
    tour = Tour(stack.url, "tour")
    tour.start()
    tour.interaction()
    for service in ("decider", "learner", "monitor", "recorder", "router", "gateway"):
        restarts = stack.inspect(service)["RestartCount"]
        stack.kill_process(service)
        tour.interaction()
        stack.wait_healthy(PATIENCE_S)
        assert stack.inspect(service)["RestartCount"] == restarts + 1, service
        tour.interaction()

    start = time.monotonic()
    assert stack.stop() == dict.fromkeys(SERVICES, 0)
    stopped_s = time.monotonic() - start
    up_s = stack.up()
    with capsys.disabled():
        print(f"\n[containers] stopped in {stopped_s:.1f} s, up again with its state {up_s:.1f} s")

    assert tour.ask("GET", tour.path)["state"] == "live"
    tour.interaction()

    ended = tour.ask("POST", f"{tour.path}/end", {})
    assert (ended["state"], ended["recording"]) == ("ended", "tour.mcap")
    assert (ended["counts"]["decision"], ended["counts"]["performance"]) == (tour.n, tour.n)
    recording = tour.client.get("/v1/recordings/tour.mcap").content
    assert hashlib.sha256(recording).hexdigest() == ended["sha256"]
    decisions = make_reader(io.BytesIO(recording)).iter_messages(topics=["decision"])
    assert [json.loads(message.data)["n"] for _, _, message in decisions] == list(range(1, tour.n + 1))
