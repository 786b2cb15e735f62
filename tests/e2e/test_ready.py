"""``/readyz`` names the service that is hung or dead, and says when it is back."""

from __future__ import annotations

import os
import signal
import time

import httpx
import pytest
from support.whole_mesh import LiveMesh

SERVICES = ("recorder", "monitor", "decider", "learner")
WITHIN_S = 5.0
"""The longest wait, s; generous for a busy machine, because the answer takes 1 s."""


def named(mesh: LiveMesh, service: str) -> None:
    end = time.monotonic() + WITHIN_S
    while True:
        answer = httpx.get(f"{mesh.url}/readyz", timeout=10.0)
        if answer.status_code == 503 and service in answer.json()["missing"]:
            return
        assert time.monotonic() < end, answer.text


@pytest.mark.parametrize("service", SERVICES)
def test_a_hung_service_is_named_and_comes_back(mesh: LiveMesh, service: str) -> None:
    pid = mesh.pid_of(f"shift_{service}")
    os.kill(pid, signal.SIGSTOP)
    try:
        named(mesh, service)
        said = mesh.ready()
        assert said["missing"] == [service]
        assert said["services"][service] == "does not answer"
        assert httpx.get(f"{mesh.url}/healthz").status_code == 200
    finally:
        os.kill(pid, signal.SIGCONT)
    mesh.until(lambda: mesh.ready()["ready"])


@pytest.mark.parametrize("service", SERVICES)
def test_a_dead_service_is_named_for_as_long_as_it_is_away(mesh: LiveMesh, service: str) -> None:
    """The supervisor is stopped meanwhile, so that it is not started again at once."""
    mesh.until(lambda: mesh.ready()["ready"])
    mesh.process.send_signal(signal.SIGSTOP)
    try:
        mesh.kill(f"shift_{service}")
        named(mesh, service)
    finally:
        mesh.process.send_signal(signal.SIGCONT)
    mesh.until(lambda: mesh.ready()["ready"])
    assert mesh.ready()["services"] == dict.fromkeys((*SERVICES, "gateway"), "ready")


def test_without_the_router_those_who_are_there_still_answer_each_other(mesh: LiveMesh) -> None:
    mesh.process.send_signal(signal.SIGSTOP)
    try:
        mesh.kill("shift_runtime.router")
        time.sleep(0.2)
        assert mesh.ready()["ready"]
    finally:
        mesh.process.send_signal(signal.SIGCONT)
    mesh.until(lambda: mesh.ready()["ready"])
