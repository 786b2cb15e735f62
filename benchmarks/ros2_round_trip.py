"""What the bridge costs: a service call through it against its parts, measured in one run, turn by turn.

``call <= 1.5 * (bare + get + fsync)``: *call* is ``/shift/next_strategy`` through bridge and decider, *bare* the
same client's call of a Trigger server of its own kind that answers at once (pyzeros, rclpy), *get* one
Zenoh request between two processes, none of our code on either side, *fsync* 4 KB to the disk of the journals.
Medians, microseconds.

    python benchmarks/ros2_round_trip.py [--calls 200] [--backend native|rclpy] [--pause SECONDS] [--check]

For ``rclpy`` the client and the bridge run in the environment that tests/support/ros_environments.py makes.
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
"""Between measurements: a robot's calls are seconds apart, and what a decision leads to must be over."""
LIMIT = 1.5


def main() -> None:
    """Measure and print; with ``--check`` exit code 1 above the limit."""
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
    """The medians, in microseconds, and their ratio."""
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
    found: dict[str, list[float]] = {kind: [] for kind in kinds}
    for turn in range(calls + 20):
        for kind, one in kinds.items():
            took = one()
            if turn >= 20:
                found[kind].append(took * 1e6)
            time.sleep(pause_s)
    medians = {kind: round(statistics.median(times), 1) for kind, times in found.items()}
    medians["p90_call"] = round(statistics.quantiles(found["call"], n=10)[8], 1)
    medians["ratio"] = round(medians["call"] / (medians["bare"] + medians["get"] + medians["fsync"]), 3)
    return medians


@contextmanager
def bare_server(bridge: Bridge) -> Iterator[None]:
    """A Trigger server of the client's kind with nothing behind it."""
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
    """One Zenoh request of this process to another, linked as the mesh's services are."""
    from shift_runtime.bus.zenoh_config import zenoh_config
    from zenoh import open as open_session

    server = subprocess.Popen([sys.executable, str(ROOT / "tests" / "ros2" / "get_server.py"), router])
    session = open_session(zenoh_config("peer", connect=router, listen="tcp/127.0.0.1:0"))

    def get() -> float:
        while True:
            started = time.perf_counter()
            replies = list(session.get("bench/get", payload=b"x" * 200, timeout=5.0))
            took = time.perf_counter() - started
            if replies:
                return took
            time.sleep(0.01)  # it is not there yet

    try:
        yield get
    finally:
        session.close()
        server.terminate()
        server.wait()


def fsync(folder: Path) -> float:
    """Seconds that 4 KB take to the disk."""
    with open(folder / "fsync", "ab") as file:
        file.write(os.urandom(4096))
        file.flush()
        started = time.perf_counter()
        os.fsync(file.fileno())
        return time.perf_counter() - started


if __name__ == "__main__":
    main()
