"""Measure the time from ``shift-mesh up`` until ``/readyz`` is true: median and range of five runs.

Measure also the time from kill -9 of each service until the mesh is ready again. Run it on an idle machine.
"""

from __future__ import annotations

import statistics
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from support.whole_mesh import LiveMesh, running_mesh

RUNS = 5
SERVICES = (
    "shift_monitor",
    "shift_decider",
    "shift_learner",
    "shift_recorder",
    "shift_gateway",
    "shift_runtime.router",
)


def startup(folder: Path) -> float:
    """Return the seconds from the command until the mesh is ready."""
    start = time.monotonic()
    with running_mesh(folder):
        return time.monotonic() - start


def recovery(mesh: LiveMesh, package: str) -> float:
    """Return the seconds from kill -9 of a running service until the mesh is ready again."""
    time.sleep(3.5)
    before = mesh.pid_of(package)
    start = time.monotonic()
    mesh.kill(package)
    mesh.until(lambda: _find_pid(mesh, package) not in (None, before))
    mesh.wait_ready()
    return time.monotonic() - start


def _find_pid(mesh: LiveMesh, package: str) -> int | None:
    try:
        return mesh.pid_of(package)
    except AssertionError:
        return None


def main() -> None:
    """Measure and print all times."""
    with tempfile.TemporaryDirectory() as folder:
        startup(Path(folder) / "warm")
        times_s = sorted(startup(Path(folder) / str(run)) for run in range(RUNS))
        print(
            f"shift-mesh up to /readyz true: median {statistics.median(times_s):.2f} s"
            f" ({times_s[0]:.2f} to {times_s[-1]:.2f}, {RUNS} runs)"
        )
        with running_mesh(Path(folder) / "recovery") as mesh:
            for package in SERVICES:
                print(f"{package} killed, ready again after {recovery(mesh, package):.2f} s")


if __name__ == "__main__":
    main()
