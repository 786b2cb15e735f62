"""A bridge as a process, a ROS router, and peers, for tests and the benchmark."""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import TracebackType
from typing import Any
from xmlrpc.client import ServerProxy

from support.free_ports import free_port
from support.ros_environments import PACKAGES, ROOT, python_of, work_folder

READY_WITHIN_S = 40.0
DEBIAN_PYTHON = "/usr/bin/python3"
"""The interpreter that sees Debian's rospy."""
STAND_INS = ("rise_stand_in",)
HERE = Path(__file__).parent / "ros_peers"


class Roscore:
    """A real roscore, on loopback: ``apt install python3-roslaunch python3-rosmaster python3-rospy rosout``."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.port = folder, free_port()
        self.process: subprocess.Popen[bytes] | None = None

    @property
    def env(self) -> dict[str, str]:
        home = str(self.folder / "ros")
        return {
            "ROS_MASTER_URI": f"http://127.0.0.1:{self.port}", "ROS_IP": "127.0.0.1", "ROS_HOME": home,
            "ROS_LOG_DIR": f"{home}/log",
        }  # fmt: skip

    def start(self) -> None:
        with open(self.folder / "roscore.log", "ab") as output:
            self.process = subprocess.Popen(
                ["/usr/bin/roscore", "-p", str(self.port)], env=os.environ | self.env, stdout=output, stderr=output
            )
        until = time.monotonic() + READY_WITHIN_S
        while not self._answers():
            assert self.process.poll() is None, (self.folder / "roscore.log").read_text()
            assert time.monotonic() < until, "roscore does not answer"
            time.sleep(0.05)

    def stop(self) -> None:
        if self.process is not None:
            self.process.send_signal(signal.SIGINT)
            self.process.wait(30)
            self.process = None

    def _answers(self) -> bool:
        try:
            master: Any = ServerProxy(self.env["ROS_MASTER_URI"])
            return bool(master.lookupNode("/tests", "/rosout")[0] == 1)
        except OSError:
            return False


class Bridge:
    """``python -m shift_ros2`` until left. The native one has a ROS router of its own, apart from the mesh's."""

    def __init__(self, zenoh: str, folder: Path, backend: str = "native", *words: str, **parameters: object) -> None:
        self.zenoh, self.folder, self.backend = zenoh, folder, backend
        self.session = str(parameters.setdefault("session", "s1"))
        parameters.setdefault("create_session", "true")
        self.router = f"tcp/127.0.0.1:{free_port()}"
        self.master = Roscore(folder)
        self.domain = random.SystemRandom().randint(1, 101) if backend == "rclpy" else 0
        self.line = [
            *("--backend", backend, "--zenoh", zenoh, "--ros-router", self.router, "--ros-args"),
            *(word for name, value in parameters.items() for word in ("-p", f"{name}:={value}")),
            *words,
        ]
        self.log = folder / f"bridge-{self.session}.log"
        self.process: subprocess.Popen[bytes] | None = None
        self._router: subprocess.Popen[bytes] | None = None

    @property
    def env(self) -> dict[str, str]:
        env = {k: v for k, v in os.environ.items() if not k.startswith(("SHIFT_", "ROS_"))}
        packages = os.pathsep.join(str(ROOT / p) for p in PACKAGES)
        return env | {
            "ROS_DOMAIN_ID": str(self.domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            "RMW_IMPLEMENTATION": "rmw_fastrtps_cpp", "PYTHONPATH": packages, **self.master.env,
        }  # fmt: skip

    @property
    def python(self) -> str:
        return python_of("rclpy") if self.backend == "rclpy" else sys.executable

    def __enter__(self) -> Bridge:
        if self.backend == "native":
            env = self.env | {"SHIFT_ROUTER_LISTEN": self.router}
            self._router = subprocess.Popen([sys.executable, "-m", "shift_runtime.router"], env=env)
        if self.backend == "rospy":
            self.master.start()
        self.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()
        if self._router is not None:
            self._router.terminate()
            self._router.wait(20)
        self.master.stop()
        if kind is not None:
            print(self.log.read_text()[-6000:])

    def start(self, wait: bool = True) -> None:
        before = self.log.stat().st_size if self.log.exists() else 0
        with open(self.log, "ab") as output:
            self.process = subprocess.Popen(
                [self.python, "-m", "shift_ros2", *self.line], env=self.env, stdout=output, stderr=output
            )
        if wait:
            self.wait_said('"state": "ready"', before)

    def wait_said(self, words: str, after: int = 0) -> None:
        until = time.monotonic() + READY_WITHIN_S
        while words not in self.log.read_text()[after:]:
            assert self.process is not None
            assert self.process.poll() is None, self.log.read_text()[after:]
            assert time.monotonic() < until, self.log.read_text()[after:]
            time.sleep(0.02)

    def kill(self) -> None:
        assert self.process is not None
        self.process.send_signal(signal.SIGKILL)
        self.process.wait(20)

    def stop(self) -> int:
        assert self.process is not None
        if self.process.poll() is None:
            self.process.terminate()
        return self.process.wait(20)


class Peer:
    """A peer process, driven by lines."""

    def __init__(self, name: str, bridge: Bridge, *words: str) -> None:
        self.name = name
        self.bridge = bridge
        program = name if name in STAND_INS else f"peer_{name}"
        arguments = words or ([] if bridge.backend != "native" else [bridge.router])
        self.process = subprocess.Popen(
            [DEBIAN_PYTHON if bridge.backend == "rospy" else python_of(name), str(HERE / f"{program}.py"), *arguments],
            env=bridge.env | {"PYTHONPATH": str(HERE)}, cwd=work_folder(),
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1,
        )  # fmt: skip
        assert self._line() == "ready"

    def ask(self, method: str, *arguments: object) -> Any:
        """Return the result of the peer's method."""
        assert self.process.stdin is not None
        self.process.stdin.write(json.dumps([method, *arguments]) + "\n")
        self.process.stdin.flush()
        answer = self._line()
        assert "ok" in answer, answer
        return answer["ok"]

    def publish(self, topic: str, message: object) -> None:
        self.ask("publish", topic, message if isinstance(message, str) else json.dumps(message))

    def decide(self, wait_s: float = 10.0) -> dict[str, Any] | None:
        """Return the next strategy, or None without an answer."""
        answer = self.ask("call", "/shift/next_strategy", wait_s)
        if answer is None:
            return None
        success, message = answer
        assert success, message
        decision: dict[str, Any] = json.loads(message)
        return decision

    def said(self, topic: str, since: int = 0) -> list[dict[str, Any]]:
        return [json.loads(text) for text in self.texts(topic, since)]

    def texts(self, topic: str, since: int = 0) -> list[str]:
        """Return what was heard on a topic, as it was published."""
        heard: list[str] = self.ask("heard", topic, since)
        return heard

    def stop(self) -> None:
        with suppress(BrokenPipeError):
            assert self.process.stdin is not None
            self.process.stdin.close()
        self.process.kill()
        self.process.wait(20)

    def _line(self) -> Any:
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        assert line, f"the peer {self.name} ended"
        return json.loads(line)


@contextmanager
def peer(name: str, bridge: Bridge, *words: str) -> Iterator[Peer]:
    """Run a peer, with words on its command line, until the context is left."""
    found = Peer(name, bridge, *words)
    try:
        yield found
    finally:
        found.stop()


@contextmanager
def rpc_peer(bridge: Bridge, folder: Path) -> Iterator[Peer]:
    """Run the peer from which the benchmark calls."""
    with peer("pyzeros" if bridge.backend == "native" else "rclpy", bridge) as found:
        yield found
