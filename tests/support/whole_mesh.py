"""A mesh of its own for a test: ``shift-mesh up`` on free ports, in a folder of its own."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx

from support.free_ports import free_port

READY_WITHIN_S = 60.0


@dataclass
class LiveMesh:
    """A running mesh."""

    process: subprocess.Popen[bytes]
    port: int
    zenoh: str
    data: Path
    log: Path

    @property
    def url(self) -> str:
        """The address of the gateway."""
        return f"http://127.0.0.1:{self.port}"

    def pid_of(self, package: str) -> int:
        """Return the process id of a service, found by its package in the command line."""
        found = self.pids_of(package)
        assert len(found) == 1, f"{package}: {found}"
        return found[0]

    def pids_of(self, package: str) -> list[int]:
        """Return the process ids of a service's workers."""
        return [
            int(entry.name) for entry in Path("/proc").iterdir() if entry.name.isdigit() and self._is(entry, package)
        ]

    def _is(self, entry: Path, package: str) -> bool:
        try:
            line = (entry / "cmdline").read_bytes().decode(errors="replace")
            parent = int((entry / "stat").read_text().rsplit(")", 1)[1].split()[1])
        except OSError:
            return False
        return package in line and parent == self.process.pid

    def kill(self, package: str) -> int:
        """Kill a service with kill -9 once it is back from the last kill; return its process id."""
        end = time.monotonic() + READY_WITHIN_S
        while not self.pids_of(package) and time.monotonic() < end:
            time.sleep(0.01)
        pid = self.pid_of(package)
        os.kill(pid, signal.SIGKILL)
        return pid

    def wait_ready(self) -> None:
        """Wait until ``/readyz`` is true."""
        end = time.monotonic() + READY_WITHIN_S
        while time.monotonic() < end:
            try:
                if httpx.get(f"{self.url}/readyz", timeout=5.0).status_code == 200:
                    return
            except httpx.HTTPError:
                pass
            assert self.process.poll() is None, self.log.read_text()
            time.sleep(0.05)
        raise AssertionError(self.log.read_text())

    def ready(self) -> dict[str, Any]:
        """Return the answer of ``/readyz``."""
        found: dict[str, Any] = httpx.get(f"{self.url}/readyz", timeout=10.0).json()
        return found

    def until(self, there: Callable[[], object]) -> None:
        """Wait until ``there()``."""
        end = time.monotonic() + READY_WITHIN_S
        while not there():
            assert time.monotonic() < end, self.log.read_text()[-8000:]
            time.sleep(0.02)

    def stop(self, number: signal.Signals = signal.SIGTERM) -> int:
        """Stop it; the exit code."""
        if self.process.poll() is None:
            self.process.send_signal(number)
        return self.process.wait(60)


@contextmanager
def running_mesh(
    folder: Path,
    *flags: str,
    port: int | None = None,
    zenoh: str | None = None,
    program: tuple[str, ...] = ("-m", "shift_cli.main"),
    environment: dict[str, str] | None = None,
) -> Iterator[LiveMesh]:
    """Run ``shift-mesh up`` until the context is left; its log is shown after a failure."""
    port = port or free_port()
    zenoh = zenoh or f"tcp/127.0.0.1:{free_port()}"
    log = folder / "mesh.log"
    command = [sys.executable, *program, "up", "--port", str(port), "--zenoh", zenoh]
    folder.mkdir(parents=True, exist_ok=True)
    with open(log, "ab") as output:
        process = subprocess.Popen(
            [*command, "--data", str(folder / "data"), *flags],
            stdout=output,
            stderr=output,
            cwd=folder,
            env=environment,
        )
    mesh = LiveMesh(process, port, zenoh, folder / "data", log)
    try:
        mesh.wait_ready()
        yield mesh
    except BaseException:
        print(log.read_text()[-8000:])
        raise
    finally:
        mesh.stop()
