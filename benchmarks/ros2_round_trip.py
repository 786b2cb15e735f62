"""What the bridge costs: a service call through it against its parts, measured in one run, turn by turn.

``call <= 1.5 * (bare + get + fsync)``: *call* is ``/shift/next_strategy`` through bridge and decider, *bare* the
same client's call of a Trigger server that answers at once (the same backend, no mesh behind it), *get* one
Zenoh request between two processes, *fsync* 4 KB to the disk of the journals. Medians, microseconds.

    python benchmarks/ros2_round_trip.py [--calls 200] [--backend native|rclpy] [--check]

For ``rclpy`` the client and the bridge run in the environment that tests/ros2/peers.py makes.
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

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "tests" / "e2e"), str(ROOT / "tests" / "ros2")]
PACE_S = 0.03
"""Between calls: a robot's are seconds apart, and what a decision leads to must be over."""
LIMIT = 1.5


def main() -> None:
    """Measure and print; with ``--check`` exit code 1 above the limit."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--calls", type=int, default=200)
    parser.add_argument("--backend", default="native")
    parser.add_argument("--check", action="store_true")
    options = parser.parse_args()
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        figures = measure(folder, options.backend, options.calls, stack)
    print(json.dumps(figures))
    sys.exit(options.check and figures["ratio"] > LIMIT)


def measure(folder: Path, backend: str, calls: int, stack: ExitStack) -> dict[str, float]:
    """The medians, in microseconds, and their ratio."""
    from mesh import running_mesh
    from ros_rig import Bridge, rpc_peer

    mesh = stack.enter_context(running_mesh(folder / "mesh"))
    bridge = stack.enter_context(Bridge(mesh.zenoh, folder, backend, task="grasp"))
    bare = stack.enter_context(bare_server(bridge))
    peer = stack.enter_context(rpc_peer(bridge, folder))
    for name in ("/shift/next_strategy", "/bare/next_strategy"):
        peer.ask("service", name)
    get = stack.enter_context(getter(mesh.zenoh))
    del bare
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
            time.sleep(PACE_S)
    medians = {kind: round(statistics.median(times), 1) for kind, times in found.items()}
    medians["p90_call"] = round(statistics.quantiles(found["call"], n=10)[8], 1)
    medians["ratio"] = round(medians["call"] / (medians["bare"] + medians["get"] + medians["fsync"]), 3)
    return medians


@contextmanager
def bare_server(bridge: object) -> Iterator[None]:
    """A Trigger server of the same backend with nothing behind it."""
    from ros_rig import Bridge

    assert isinstance(bridge, Bridge)
    with bridge.beside([str(ROOT / "tests" / "ros2" / "bare_server.py")]):
        yield


@contextmanager
def getter(zenoh: str) -> Iterator[Callable[[], float]]:
    """One Zenoh request of this process to another, over the mesh's bus."""
    import asyncio

    from shift_runtime.zenoh_bus import ZenohBus

    server = subprocess.Popen([sys.executable, str(ROOT / "tests" / "ros2" / "get_server.py"), zenoh])
    loop = asyncio.new_event_loop()
    bus = loop.run_until_complete(ZenohBus.open(zenoh, "tcp/127.0.0.1:0"))

    def get() -> float:
        async def timed() -> float:
            while True:
                started = time.perf_counter()
                replies = await bus.get("bench/get", b"x" * 200, timeout_s=5.0)
                took = time.perf_counter() - started
                if replies:
                    return took
                await asyncio.sleep(0.01)  # it is not there yet

        return loop.run_until_complete(timed())

    try:
        yield get
    finally:
        loop.run_until_complete(bus.close())
        loop.close()
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
