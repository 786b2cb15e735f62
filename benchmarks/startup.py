"""How long ``shift-mesh up`` takes until ``/readyz`` is true: median of five with spread.

And from kill -9 of each service until it is ready again. Run it with nothing else running.
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
    """Seconds from the command to ready."""
    begun = time.monotonic()
    with running_mesh(folder):
        return time.monotonic() - begun


def recovery(mesh: LiveMesh, package: str) -> float:
    """Seconds from kill -9 of a service that had lived for a while to ready."""
    time.sleep(3.5)
    before = mesh.pid_of(package)
    begun = time.monotonic()
    mesh.kill(package)
    mesh.until(lambda: _there(mesh, package) not in (None, before))
    mesh.wait_ready()
    return time.monotonic() - begun


def _there(mesh: LiveMesh, package: str) -> int | None:
    try:
        return mesh.pid_of(package)
    except AssertionError:
        return None


def main() -> None:
    """Measure and print."""
    with tempfile.TemporaryDirectory() as folder:
        startup(Path(folder) / "warm")
        took = sorted(startup(Path(folder) / str(run)) for run in range(RUNS))
        print(
            f"shift-mesh up to /readyz true: median {statistics.median(took):.2f} s"
            f" ({took[0]:.2f} to {took[-1]:.2f}, {RUNS} runs)"
        )
        with running_mesh(Path(folder) / "recovery") as mesh:
            for package in SERVICES:
                print(f"{package} killed, ready again after {recovery(mesh, package):.2f} s")


if __name__ == "__main__":
    main()
