"""Requests per second of a whole mesh with many clients, beside a minimal FastAPI application in the same run.

    python benchmarks/rest_load.py --clients 32 --turns 3

The requests of the mesh and of the reference take turns. The ratio is that of the medians of the turns, and its spread
that of the turns. Clients run in a process of their own and share the processor with the mesh, as the reference's do.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import multiprocessing
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
from rich.console import Console
from rich.progress import track
from rich.table import Table

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from rest import BARE
from support.free_ports import free_port
from support.whole_mesh import running_mesh

Request = tuple[str, str, Any]
"""Method, path and body."""
RESULT = {"success": True, "duration_s": 5.0}


def starts(turn: int, client: int, n: int) -> Request:
    """Return the start of a new session."""
    return "POST", "/v1/sessions", {"participant": "P01", "session": f"new-{turn}-{client}-{n}"}


def decisions(turn: int, client: int, n: int) -> Request:
    """Return a decision in the client's own session."""
    body = {"task": "grasp", "decision_id": f"d{turn}-{n}"}
    return "POST", f"/v1/sessions/c{client}/decisions", body


def previews(turn: int, client: int, n: int) -> Request:
    """Return a preview in the client's own session."""
    return "GET", f"/v1/sessions/c{client}/strategy?task=grasp", None


def hellos(turn: int, client: int, n: int) -> Request:
    """Return the reference's request."""
    return "GET", "/", None


KINDS: dict[str, tuple[Callable[[int, int, int], Request], int]] = {
    "bare FastAPI hello": (hellos, 400), "session starts": (starts, 10), "decisions": (decisions, 40),
    "previews": (previews, 150),
}  # fmt: skip
"""Each request with how many of them a client makes in one turn."""


def load(url: str, kind: str, turn: int, clients: int, answer: Any) -> None:
    """Send all requests of a turn; put how many were answered in a second into ``answer``."""
    answer.put(asyncio.run(_load(url, kind, turn, clients)))


async def _load(url: str, kind: str, turn: int, clients: int) -> float:
    request, count = KINDS[kind]
    where = httpx.URL(url)
    streams = [await asyncio.open_connection(where.host, where.port) for _ in range(clients)]

    async def one(client: int) -> None:
        reader, writer = streams[client]
        for n in range(count):
            await _answered(reader, writer, *request(turn, client, n))
        writer.close()

    begun = time.perf_counter()
    await asyncio.gather(*(one(client) for client in range(clients)))
    return clients * count / (time.perf_counter() - begun)


async def _answered(
    reader: asyncio.StreamReader, writer: asyncio.StreamWriter, method: str, path: str, body: object
) -> None:
    """Make one request on an open connection with as little work as possible.

    A client library would cost more than the request of `hello`.
    """
    content = json.dumps(body).encode() if body is not None else b""
    head = f"{method} {path} HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: application/json\r\nContent-Length: "
    writer.write(f"{head}{len(content)}\r\n\r\n".encode() + content)
    answer = (await reader.readuntil(b"\r\n\r\n")).decode().lower()
    length = int(answer.partition("content-length:")[2].partition("\r\n")[0])
    found = await reader.readexactly(length)
    if not 200 <= int(answer.split()[1]) < 300:
        raise RuntimeError(found.decode())


def per_second(url: str, kind: str, turn: int, clients: int) -> float:
    """Return how many requests are answered in a second."""
    context = multiprocessing.get_context("spawn")
    answer = context.Queue()
    process = context.Process(target=load, args=(url, kind, turn, clients, answer))
    process.start()
    found: float = answer.get(timeout=120)
    process.join()
    return found


def main() -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--clients", type=int, default=32, help="How many clients ask at once.")
    parser.add_argument("--turns", type=int, default=3, help="How often each request is measured.")
    options = parser.parse_args()
    port = free_port()
    bare = subprocess.Popen([sys.executable, "-c", BARE, str(port)])
    found: dict[str, list[float]] = {kind: [] for kind in KINDS}
    try:
        with tempfile.TemporaryDirectory() as folder, running_mesh(Path(folder)) as mesh:
            for client in range(options.clients):
                body = {"participant": "P01", "session": f"c{client}"}
                httpx.post(f"{mesh.url}/v1/sessions", json=body).raise_for_status()
            for turn in track(range(options.turns), "turns", console=Console(stderr=True)):
                for kind in KINDS:
                    url = mesh.url if kind != "bare FastAPI hello" else f"http://127.0.0.1:{port}"
                    found[kind].append(per_second(url, kind, turn, options.clients))
    finally:
        bare.terminate()
        bare.wait(10)
    reference = found["bare FastAPI hello"]
    table = Table("request", "per second", "of hello's", "spread")
    for kind, rates in found.items():
        ratios = sorted(rate / hello for rate, hello in zip(rates, reference, strict=True))
        table.add_row(
            kind, f"{statistics.median(rates):.0f}", f"{statistics.median(rates) / statistics.median(reference):.2f}",
            f"{ratios[0]:.2f} to {ratios[-1]:.2f}",
        )  # fmt: skip
    Console().print(table)


if __name__ == "__main__":
    main()
