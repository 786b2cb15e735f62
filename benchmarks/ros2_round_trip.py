"""Compare a service call through the ROS bridge with its parts, in turns within one run.

The limit is ``call <= 1.5 * (bare + get + fsync)``, for medians in microseconds:

- *call* is ``/shift/next_strategy`` through bridge and decider;
- *bare* is a call from the same client to a Trigger server of its own kind (pyzeros, rclpy) that answers at once;
- *get* is one Zenoh request between two processes without any code of this project;
- *fsync* writes 4 KB to the disk of the journals.

    python benchmarks/ros2_round_trip.py [--calls 200] [--backend native|rclpy] [--pause SECONDS] [--check]

For ``rclpy``, the client and the bridge run in the environment that tests/support/ros_environments.py makes.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from support.ros_rig import Bridge

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "tests")]
PAUSE_S = 0.03
"""Time between measurements: the work that follows a decision must be complete, as between a robot's calls."""
LIMIT = 1.5


def main() -> None:
    """Measure and print; with ``--check``, exit with 1 above the limit."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--calls", type=int, default=200)
    parser.add_argument("--backend", default="native")
    parser.add_argument("--pause", type=float, default=PAUSE_S)
    parser.add_argument("--check", action="store_true")
    options = parser.parse_args()
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        figures = measure(folder, options.backend, options.calls, options.pause, stack)
    print(json.dumps(figures))
    sys.exit(options.check and figures["ratio"] > LIMIT)


def measure(folder: Path, backend: str, calls: int, pause_s: float, stack: ExitStack) -> dict[str, float]:
    """Return the medians in microseconds, and their ratio."""
    from support.ros_rig import Bridge, rpc_peer
    from support.whole_mesh import running_mesh

    mesh = stack.enter_context(running_mesh(folder / "mesh"))
    bridge = stack.enter_context(Bridge(mesh.zenoh, folder, backend, task="grasp"))
    stack.enter_context(bare_server(bridge))
    peer = stack.enter_context(rpc_peer(bridge, folder))
    for name in ("/shift/next_strategy", "/bare/next_strategy"):
        peer.ask("service", name)
    get = stack.enter_context(getter(mesh.zenoh))
    kinds: dict[str, Callable[[], float]] = {
        "call": lambda: float(peer.ask("timed_call", "/shift/next_strategy")),
        "bare": lambda: float(peer.ask("timed_call", "/bare/next_strategy")),
        "get": get,
        "fsync": lambda: fsync(folder),
    }
    times_us: dict[str, list[float]] = {kind: [] for kind in kinds}
    for turn in range(calls + 20):
        for kind, measure_s in kinds.items():
            time_s = measure_s()
            if turn >= 20:
                times_us[kind].append(time_s * 1e6)
            time.sleep(pause_s)
    medians = {kind: round(statistics.median(times), 1) for kind, times in times_us.items()}
    medians["p90_call"] = round(statistics.quantiles(times_us["call"], n=10)[8], 1)
    medians["ratio"] = round(medians["call"] / (medians["bare"] + medians["get"] + medians["fsync"]), 3)
    return medians


@contextmanager
def bare_server(bridge: Bridge) -> Iterator[None]:
    """Run a Trigger server of the client's kind that answers at once."""
    from support.ros_environments import python_of, work_folder

    kind = "pyzeros" if bridge.backend == "native" else "rclpy"
    command = [python_of(kind), str(ROOT / "tests" / "support" / "ros_peers" / f"bare_{kind}.py"), bridge.router]
    server = subprocess.Popen(command, env=bridge.env, cwd=work_folder())
    try:
        yield
    finally:
        server.kill()
        server.wait()


@contextmanager
def getter(router: str) -> Iterator[Callable[[], float]]:
    """Yield a function that times one Zenoh request to another process, with the links of the mesh's services."""
    from shift_runtime.bus.zenoh_config import zenoh_config
    from zenoh import open as open_session

    server = subprocess.Popen([sys.executable, str(ROOT / "tests" / "ros2" / "get_server.py"), router])
    session = open_session(zenoh_config("peer", connect=router, listen="tcp/127.0.0.1:0"))

    def get() -> float:
        while True:
            started = time.perf_counter()
            replies = list(session.get("bench/get", payload=b"x" * 200, timeout=5.0))
            time_s = time.perf_counter() - started
            if replies:
                return time_s
            time.sleep(0.01)  # the server is not ready yet

    try:
        yield get
    finally:
        session.close()
        server.terminate()
        server.wait()


def fsync(folder: Path) -> float:
    """Return the seconds to write 4 KB to the disk."""
    with open(folder / "fsync", "ab") as file:
        file.write(os.urandom(4096))
        file.flush()
        started = time.perf_counter()
        os.fsync(file.fileno())
        return time.perf_counter() - started


if __name__ == "__main__":
    main()
