"""A mesh in containers for tests: build, up, look inside, kill, stop, remove. The engine is the real one.

Everything it makes is called ``shift-mesh-test...``. ``SHIFT_TEST_IMAGE`` names an image that is built
already, ``SHIFT_TEST_BASE`` another base image to build on.
"""

from __future__ import annotations

import json
import os
import secrets
import shutil
import subprocess
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from support.free_ports import free_port

ROOT = Path(__file__).resolve().parents[2]
SERVICES = ("router", "recorder", "monitor", "decider", "learner", "gateway", "simulator")


def run(*command: str, env: dict[str, str] | None = None, check: bool = True) -> str:
    """Return the standard output of a command at the repository's root; an error shows both outputs."""
    done = subprocess.run(
        command, cwd=ROOT, env={**os.environ, **(env or {})}, capture_output=True, text=True, check=False
    )
    if check and done.returncode:
        raise AssertionError(f"{' '.join(command)} ended with {done.returncode}\n{done.stdout}\n{done.stderr}")
    return done.stdout.strip()


def succeeds(*command: str) -> bool:
    return shutil.which(command[0]) is not None and (
        subprocess.run(command, capture_output=True, check=False).returncode == 0
    )


def compose_command() -> tuple[str, ...] | None:
    """Return Compose v2 if it is installed, else the older docker-compose."""
    return next(
        (c for c in (("docker", "compose"), ("docker-compose",)) if succeeds(*c, "version")),
        None,
    )


def why_no_engine() -> str | None:
    """Return why the tests cannot run here, or None. With CI=true they must run, so that a reason is a failure."""
    if not succeeds("docker", "version"):
        reason = "no container engine answers `docker version`, so nothing is tried in containers"
    elif compose_command() is None:
        reason = "neither `docker compose` nor `docker-compose` is there, so nothing is tried in containers"
    else:
        return None
    if os.environ.get("CI") == "true":
        pytest.fail(f"{reason}; with CI=true it has to be")
    return reason


@dataclass
class Stack:
    """The mesh of ``docker-compose.yml`` under a name, an image and a port of its own."""

    image: str
    base: str
    own_image: bool
    build_s: float
    project: str = field(default_factory=lambda: f"shift-mesh-test-{secrets.token_hex(3)}")
    port: int = field(default_factory=free_port)
    up_s: float = 0.0

    @classmethod
    def built(cls) -> Stack:
        """Build the image as `make image` does, and return its name."""
        given = os.environ.get("SHIFT_TEST_IMAGE")
        if given:
            return cls(image=given, base="", own_image=False, build_s=0.0)
        base = run("tests/containers/base_image.sh").splitlines()[-1]
        image = f"shift-mesh-test:{secrets.token_hex(3)}"
        start = time.monotonic()
        run("make", "image", f"IMAGE={image}", f"BASE={base}")
        return cls(image=image, base=base, own_image=True, build_s=time.monotonic() - start)

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    def compose(self, *arguments: str, check: bool = True) -> str:
        env = {"SHIFT_IMAGE": self.image, "SHIFT_BASE": self.base, "SHIFT_PORT": str(self.port)}
        return run(*(compose_command() or ()), "-p", self.project, *arguments, env=env, check=check)

    def up(self, patience_s: float = 120.0) -> float:
        """Start the stack, wait until it is healthy, and return the seconds that it took."""
        start = time.monotonic()
        self.compose("up", "-d")
        self.wait_healthy(patience_s)
        self.up_s = time.monotonic() - start
        return self.up_s

    def stop(self) -> dict[str, int]:
        """Stop all as an operator does; returns the exit codes."""
        self.compose("stop")
        return {service: self.inspect(service)["State"]["ExitCode"] for service in SERVICES}

    def remove(self) -> None:
        """Take away containers, networks, the volume and the image."""
        self.compose("down", "--volumes", "--remove-orphans", "--timeout", "5", check=False)
        if self.own_image:
            run("docker", "image", "rm", self.image, check=False)

    def wait_healthy(self, patience_s: float) -> None:
        deadline = time.monotonic() + patience_s
        while (health := {s: self.health(s) for s in SERVICES}) != dict.fromkeys(SERVICES, "healthy"):
            assert time.monotonic() < deadline, f"after {patience_s} s: {health}\n{self.logs()}"
            time.sleep(0.2)

    def health(self, service: str) -> str:
        return str(self.inspect(service)["State"].get("Health", {}).get("Status", "without a check"))

    def container(self, service: str) -> str:
        """Return the id of the service's container."""
        labels = (f"project={self.project}", f"service={service}")
        filters = [word for label in labels for word in ("--filter", f"label=com.docker.compose.{label}")]
        ids = run("docker", "ps", "--all", "--quiet", *filters).split()
        assert len(ids) == 1, f"{service} has {len(ids)} containers"
        return ids[0]

    def inspect(self, service: str) -> dict[str, Any]:
        return dict(json.loads(run("docker", "inspect", self.container(service)))[0])

    def python(self, service: str, code: str, *options: str) -> str:
        """Return what a line of Python prints inside a service's container."""
        return run("docker", "exec", *options, self.container(service), "python", "-c", code)

    def kill_process(self, service: str) -> None:
        """Kill a process from outside: `docker kill` counts as a stop by hand, after which nothing restarts it."""
        pid = self.inspect(service)["State"]["Pid"]
        code = f"import os; os.kill({pid}, 9)"
        namespaces = ("--pid", "host", "--user", "0", "--network", "none")
        run("docker", "run", "--rm", *namespaces, self.image, "python", "-c", code)

    def logs(self) -> str:
        return run(*(compose_command() or ()), "-p", self.project, "logs", "--no-color", "--tail=80", check=False)
