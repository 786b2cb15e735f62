"""How many people with gaze at 120 Hz a mesh carries, and what one chunk costs each service.

A generator in a process of its own sends real recordings (``tests/data/gaze``, thinned to 120 Hz) in chunks of ten
samples, over Zenoh or over one WebSocket for each session. After the last chunk the benchmark waits until every sample
is in the observations: that time is how far the mesh is behind. The processor time of each service stands in ``/proc``.
The reference is a loop that reads and writes the same chunks as JSON, in this process, in the same run.

    python benchmarks/gaze_load.py --people 20
    python benchmarks/gaze_load.py --people 50 100 200 --seconds 15
"""

from __future__ import annotations

import argparse
import asyncio
import json
import multiprocessing
import os
import sys
import tempfile
import time
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import httpx
import websockets
import zenoh
from rich.console import Console
from rich.table import Table
from shift_runtime.bus.zenoh_config import zenoh_config
from shift_schemas.shards import Shard, shard_of
from shift_sources.files.formats import read_samples

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from support.whole_mesh import LiveMesh, running_mesh

RATE_HZ, CHUNK = 120, 10
SERVICES = (
    "shift_monitor",
    "shift_recorder",
    "shift_decider",
    "shift_learner",
    "shift_gateway",
    "shift_runtime.router",
)
RECORDINGS = sorted((Path(__file__).parents[1] / "tests" / "data" / "gaze").glob("*.tsv.gz"))
BEHIND_S = 1.0
"""A mesh that needs longer than this after the last chunk is behind."""


def chunks(person: int, count: int) -> Iterator[bytes]:
    """Yield ``count`` chunks of one person as JSON: a real recording at 120 Hz, again and again."""
    samples = list(read_samples(RECORDINGS[person % len(RECORDINGS)]))[:: 300 // RATE_HZ]
    for seq in range(count):
        part = [samples[(seq * CHUNK + i) % len(samples)] for i in range(CHUNK)]
        yield json.dumps({
            "source": "eyes", "seq": seq, "t": [(seq * CHUNK + i) / RATE_HZ for i in range(CHUNK)],
            "x": [s.x for s in part], "y": [s.y for s in part], "valid": [s.valid for s in part],
        }).encode()  # fmt: skip


def send(over: str, where: str, sessions: list[str], seconds: float, workers: int) -> None:
    """Send gaze to every session at its rate."""
    count = round(seconds * RATE_HZ / CHUNK)
    prepared = [list(chunks(i, count)) for i in range(min(len(sessions), len(RECORDINGS)))]
    if over == "zenoh":
        asyncio.run(_over_zenoh(where, sessions, prepared, count, workers))
    else:
        asyncio.run(_over_websockets(where, sessions, prepared, count))


def key_of(session: str, workers: int) -> str:
    """Return the key of a session's gaze, as a client without a namespace of its own sees it."""
    name = Shard(shard_of(session, workers), workers).name
    return f"{name}/shift/v1/{session}/in/gaze".removeprefix("/")


async def _over_zenoh(where: str, sessions: list[str], prepared: list[list[bytes]], count: int, workers: int) -> None:
    with zenoh.open(zenoh_config("client", connect=where)) as bus:
        puts = [bus.declare_publisher(key_of(s, workers)) for s in sessions]
        await asyncio.sleep(1)
        begun = time.monotonic()
        period_s = CHUNK / RATE_HZ / len(sessions)
        for n in range(count):
            for i, publisher in enumerate(puts):
                delay_s = begun + (n * len(puts) + i) * period_s - time.monotonic()
                if delay_s > 0.002:
                    await asyncio.sleep(delay_s)
                publisher.put(prepared[i % len(prepared)][n])
        await asyncio.sleep(0.2)


async def _over_websockets(where: str, sessions: list[str], prepared: list[list[bytes]], count: int) -> None:
    await asyncio.gather(*(
        _over_websocket(where, s, prepared[i % len(prepared)], i / len(sessions)) for i, s in enumerate(sessions)
    ))  # fmt: skip


async def _over_websocket(where: str, session: str, mine: list[bytes], share: float) -> None:
    async with websockets.connect(f"{where}/v1/sessions/{session}/gaze") as socket:
        await asyncio.sleep(share * CHUNK / RATE_HZ)
        begun = time.monotonic()
        for n, chunk in enumerate(mine):
            await asyncio.sleep(max(0.0, begun + n * CHUNK / RATE_HZ - time.monotonic()))
            await socket.send(chunk.decode())
            await socket.recv()


def processor_s(mesh: LiveMesh) -> dict[str, float]:
    """Return the processor time of each service so far, in seconds."""
    ticks = os.sysconf("SC_CLK_TCK")
    used = {}
    for service in SERVICES:
        pids = mesh.pids_of(service)
        fields = [Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split() for pid in pids]
        used[service] = sum(int(f[11]) + int(f[12]) for f in fields) / ticks
    return used


def samples_of(client: httpx.Client, sessions: list[str]) -> list[int]:
    """Return how many samples each session's observation counts."""
    return [client.get(f"/v1/sessions/{s}/observation").json()["gaze"]["samples"] for s in sessions]


def measure(people: int, seconds: float, over: str, workers: int) -> dict[str, float]:
    """Return the time that the mesh was behind after the last chunk, and the processor time of each service."""
    with (
        tempfile.TemporaryDirectory() as folder,
        running_mesh(Path(folder), "--workers", str(workers)) as mesh,
        httpx.Client(base_url=mesh.url, timeout=60.0) as client,
    ):
        names = [f"s{i}" for i in range(people)]
        for name in names:
            client.post("/v1/sessions", json={"participant": "P01", "session": name}).raise_for_status()
        time.sleep(2)
        before = processor_s(mesh)
        where = mesh.zenoh if over == "zenoh" else mesh.url.replace("http", "ws")
        generator = multiprocessing.get_context("spawn").Process(
            target=send, args=(over, where, names, seconds, workers)
        )
        generator.start()
        generator.join()
        ended = time.monotonic()
        wanted = round(seconds * RATE_HZ / CHUNK) * CHUNK
        while min(samples_of(client, names[-1:])) < wanted and time.monotonic() < ended + 120:
            time.sleep(0.05)
        behind_s = time.monotonic() - ended
        after = processor_s(mesh)
        lost = sum(wanted - n for n in samples_of(client, names))
    return {"behind": behind_s, "lost": lost, **{s: after[s] - before[s] for s in SERVICES}}


def reference_s() -> float:
    """Return the seconds that one chunk takes to be read as JSON and written again."""
    texts = list(islice(chunks(0, 1000), 1000))
    begun = time.process_time()
    for text in texts:
        json.dumps(json.loads(text))
    return (time.process_time() - begun) / len(texts)


def main() -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--people", type=int, nargs="+", default=[20], help="How many people; several are measured in turn."
    )
    parser.add_argument("--seconds", type=float, default=15.0, help="How long they look.")
    parser.add_argument("--over", choices=["zenoh", "websocket"], default="zenoh", help="The way of the gaze.")
    parser.add_argument("--workers", type=int, default=1, help="Workers of each service.")
    options = parser.parse_args()
    names = [service.removeprefix("shift_").removeprefix("runtime.") for service in SERVICES]
    table = Table("people", "behind", "lost samples", *(f"{name} ms/chunk" for name in names), "sum", "JSON reference")
    for people in options.people:
        found = measure(people, options.seconds, options.over, options.workers)
        count = people * round(options.seconds * RATE_HZ / CHUNK)
        each = [1000 * found[service] / count for service in SERVICES]
        reference = 1000 * reference_s()
        table.add_row(
            str(people), f"{found['behind']:.1f} s", f"{found['lost']:.0f}", *(f"{ms:.3f}" for ms in each),
            f"{sum(each):.2f} ms", f"{reference:.3f} ms (ratio {sum(each) / reference:.0f})",
        )  # fmt: skip
    Console(width=180).print(table)


if __name__ == "__main__":
    main()
