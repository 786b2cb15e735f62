"""Compare REST requests with a minimal FastAPI application: medians, and ratios with their quartiles.

    python benchmarks/rest.py

The requests take turns on connections that stay open. Compare ratios: times change with the load of the machine.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import httpx

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from support.free_ports import free_port
from support.whole_mesh import running_mesh

ROUNDS = 400
BARE = """
import sys, uvicorn
from fastapi import FastAPI
app = FastAPI()
@app.get("/")
async def hello() -> dict[str, str]:
    return {"hello": "world"}
uvicorn.run(app, port=int(sys.argv[1]), log_level="warning", access_log=False)
"""


def main() -> None:
    """Measure and print the times of all requests."""
    port = free_port()
    bare = subprocess.Popen([sys.executable, "-c", BARE, str(port)])
    try:
        with (
            tempfile.TemporaryDirectory() as folder,
            running_mesh(Path(folder)) as mesh,
            httpx.Client(base_url=f"http://127.0.0.1:{port}") as hello,
            httpx.Client(base_url=mesh.url) as shift,
        ):
            _wait(hello)
            _measure(hello, shift)
    finally:
        bare.terminate()
        bare.wait(10)


def _wait(hello: httpx.Client) -> None:
    while True:
        try:
            hello.get("/")
        except httpx.TransportError:
            time.sleep(0.1)
        else:
            return


def _measure(hello: httpx.Client, shift: httpx.Client) -> None:
    path = "/v1/sessions/bench"
    shift.post("/v1/sessions", json={"participant": "P1", "session": "bench"}).raise_for_status()
    result = {"success": True, "duration_s": 5.0}
    requests: dict[str, Callable[[int], httpx.Response]] = {
        "bare FastAPI hello": lambda n: hello.get("/"),
        "GET observation, just after a report": lambda n: shift.get(f"{path}/observation"),
        "GET observation, nothing new": lambda n: shift.get(f"{path}/observation"),
        "POST gaze, 10 samples (one fsync)": lambda n: shift.post(f"{path}/gaze", json=_chunk(n)),
        "POST decisions (two services, fsyncs)": lambda n: shift.post(
            f"{path}/decisions", json={"task": "t", "decision_id": f"d{n}"}
        ),
        "POST performance (one fsync)": lambda n: shift.post(
            f"{path}/performance", json={"decision_id": f"d{n}", "comprehension": result, "enabledness": result}
        ),
    }
    times: dict[str, list[float]] = {name: [] for name in requests}
    for n in range(ROUNDS):
        for name, request in requests.items():
            start = time.perf_counter()
            request(n).raise_for_status()
            times[name].append(time.perf_counter() - start)
    _print(times)


def _chunk(n: int) -> dict[str, object]:
    t = [n * 0.1 + i * 0.01 for i in range(10)]
    return {"source": "bench", "seq": n, "t": t, "x": [0.1] * 10, "y": [0.5] * 10, "valid": [True] * 10}


def _print(times: dict[str, list[float]]) -> None:
    reference = next(iter(times.values()))
    print(f"{'request':40} {'median':>10} {'ratio to hello: quartiles':>32}")
    for name, seconds in times.items():
        low, middle, high = statistics.quantiles([s / r for s, r in zip(seconds, reference, strict=True)], n=4)
        print(f"{name:40} {statistics.median(seconds) * 1e3:8.2f} ms {low:10.2f} {middle:10.2f} {high:10.2f}")


if __name__ == "__main__":
    main()
