"""The price of an open page: a decision's latency over REST with a room view open, against the same without it.

Twenty sessions receive gaze at 120 Hz. The latency is measured in turns without and with a page in one run. The ratio
is that of the medians, and its spread that of the turns. The browser runs on the same machine, and nothing else should.

    python benchmarks/web_page.py --sessions 20 --turns 5
"""

from __future__ import annotations

import argparse
import asyncio
import json
import multiprocessing
import random
import statistics
import sys
import tempfile
import time
from pathlib import Path

import httpx
import websockets
from rich.console import Console
from rich.progress import track
from rich.table import Table

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from support.browser import chromium, opened_tab
from support.whole_mesh import running_mesh

RATE_HZ, CHUNK = 120, 15
DECISIONS = 60
COUNT_UPDATES = "() => { window.heards = 0; const f = shift.heard; shift.heard = (m) => { window.heards += 1; f(m); } }"


def feed(port: int, sessions: list[str]) -> None:
    """Send gaze at 120 Hz to every session until the process is ended."""
    asyncio.run(_feed_all(port, sessions))


async def _feed_all(port: int, sessions: list[str]) -> None:
    await asyncio.gather(*(_feed_one(port, session, i / len(sessions)) for i, session in enumerate(sessions)))


async def _feed_one(port: int, session: str, share: float) -> None:
    draw = random.Random(session)
    period_s = CHUNK / RATE_HZ
    await asyncio.sleep(share * period_s)
    async with websockets.connect(f"ws://127.0.0.1:{port}/v1/sessions/{session}/gaze") as socket:
        begun = time.monotonic()
        for seq in range(10**9):
            x, y = draw.random(), draw.random()
            chunk = {
                "source": "eyes", "seq": seq, "t": [(seq * CHUNK + i) / RATE_HZ for i in range(CHUNK)],
                "x": [x] * CHUNK, "y": [y] * CHUNK, "valid": [True] * CHUNK,
            }  # fmt: skip
            await socket.send(json.dumps(chunk))
            await socket.recv()
            await asyncio.sleep(max(0.0, begun + (seq + 1) * period_s - time.monotonic()))


def decision_latencies(client: httpx.Client, session: str, name: str) -> list[float]:
    """Return the seconds that each of the decisions takes, 30 ms after the one before."""
    taken = []
    for n in range(DECISIONS):
        body = {"task": "grasp", "decision_id": f"{name}-{n}"}
        begun = time.perf_counter()
        client.post(f"/v1/sessions/{session}/decisions", json=body).raise_for_status()
        taken.append(time.perf_counter() - begun)
        time.sleep(0.03)
    return taken


def main() -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sessions", type=int, default=20, help="How many sessions receive gaze.")
    parser.add_argument("--turns", type=int, default=5, help="How often each of the two is measured.")
    options = parser.parse_args()
    without: list[float] = []
    with_page: list[float] = []
    rates: list[float] = []
    names = [f"s{i}" for i in range(options.sessions)]
    with (
        tempfile.TemporaryDirectory() as folder,
        running_mesh(Path(folder)) as mesh,
        httpx.Client(base_url=mesh.url, timeout=30.0) as client,
        chromium() as browser,
    ):
        for name in names:
            client.post("/v1/sessions", json={"participant": "P01", "session": name}).raise_for_status()
        feeder = multiprocessing.get_context("spawn").Process(target=feed, args=(mesh.port, names), daemon=True)
        feeder.start()
        time.sleep(3)
        for turn in track(range(options.turns), "turns", console=Console(stderr=True)):
            without.append(statistics.median(decision_latencies(client, names[0], f"a{turn}")))
            with opened_tab(browser, mesh.url) as tab:
                tab.go(f"/session/{names[0]}")
                tab.wait_text("decision-number", str((2 * turn + 1) * DECISIONS))
                time.sleep(1)
                tab.page.evaluate(COUNT_UPDATES)
                begun = time.perf_counter()
                with_page.append(statistics.median(decision_latencies(client, names[0], f"b{turn}")))
                rates.append(tab.page.evaluate("() => window.heards") / (time.perf_counter() - begun))
        feeder.terminate()
        feeder.join()
    ratios = sorted(b / a for a, b in zip(without, with_page, strict=True))
    table = Table("figure", "without a page", "with a page", "ratio", "spread")
    middle = statistics.median(without), statistics.median(with_page)
    table.add_row(
        "decision", f"{middle[0] * 1e3:.2f} ms", f"{middle[1] * 1e3:.2f} ms", f"{middle[1] / middle[0]:.2f}",
        f"{ratios[0]:.2f} to {ratios[-1]:.2f}",
    )  # fmt: skip
    Console().print(table)
    Console().print(f"the page updates {statistics.median(rates):.1f} times a second ({min(rates):.1f} at least)")


if __name__ == "__main__":
    main()
