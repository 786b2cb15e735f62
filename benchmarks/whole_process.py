"""Compare the times of two checkouts: start, decision, gaze chunk, Table II, verify.

The checkouts take turns (A B A B ...), each with its own packages and the same Python. The ratio is the later median
divided by the earlier one. The spread is the range of the ratios of single turns. Run it on an idle machine.

    python benchmarks/whole_process.py --before ../shift-0.2 --after . --turns 5
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import httpx
from rich.console import Console
from rich.progress import track
from rich.table import Table

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from support.whole_mesh import running_mesh

REQUESTS = 60
RECORDING = Path(__file__).resolve().parents[1] / "tests" / "data" / "v0.1" / "configured.mcap"


def environment(checkout: Path) -> dict[str, str]:
    """Return the environment in which Python imports the packages of ``checkout``."""
    packages = [str(path.parent.parent.resolve()) for path in checkout.glob("s*/**/shift_*/__init__.py")]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(packages)}


def command_s(checkout: Path, *words: str) -> float:
    """Return the seconds that a command of the command line takes."""
    start = time.perf_counter()
    subprocess.run(
        [sys.executable, "-m", "shift_cli.main", *words], env=environment(checkout), check=True, capture_output=True
    )
    return time.perf_counter() - start


def mesh_figures(checkout: Path, folder: Path) -> dict[str, float]:
    """Start a mesh; return the seconds until it is ready, and the median seconds of a decision and of a gaze chunk."""
    start = time.perf_counter()
    with running_mesh(folder, environment=environment(checkout)) as mesh:
        ready = time.perf_counter() - start
        with httpx.Client(base_url=mesh.url, timeout=30.0) as client:
            return {"up to ready": ready, **request_figures(client)}


def request_figures(client: httpx.Client) -> dict[str, float]:
    """Return the median seconds of a gaze chunk and of a decision, each acknowledged before the next."""
    client.post("/v1/sessions", json={"participant": "P01", "session": "s1"}).raise_for_status()
    times: dict[str, list[float]] = {"gaze chunk": [], "decision": []}
    for n in range(REQUESTS):
        chunk = {"source": "a", "seq": n, "t": [n / 10 + i / 100 for i in range(10)], "aoi": ["left"] * 10}
        for name, path, body in (
            ("gaze chunk", "gaze", chunk),
            ("decision", "decisions", {"task": "grasp", "decision_id": f"d{n}"}),
        ):
            start = time.perf_counter()
            client.post(f"/v1/sessions/s1/{path}", json=body).raise_for_status()
            times[name].append(time.perf_counter() - start)
        result = {"success": True, "duration_s": 5.0}
        report = {"decision_id": f"d{n}", "comprehension": result, "enabledness": result}
        client.post("/v1/sessions/s1/performance", json=report).raise_for_status()
        time.sleep(0.03)
    return {name: statistics.median(values) for name, values in times.items()}


def figures(checkout: Path) -> dict[str, float]:
    """Return every figure of a checkout, in seconds."""
    with tempfile.TemporaryDirectory() as folder:
        result = mesh_figures(checkout, Path(folder))
    result["evaluate table2"] = command_s(checkout, "evaluate", "table2", "--seed", "1", "--json")
    result["verify"] = command_s(checkout, "verify", str(RECORDING))
    return result


def main() -> None:
    """Measure both checkouts in turns and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--before", type=Path, help="Checkout of the earlier version; required for a measurement.")
    parser.add_argument("--after", type=Path, default=Path(__file__).parents[1], help="Checkout of the later version.")
    parser.add_argument("--turns", type=int, default=5, help="Number of measurements of each checkout.")
    options = parser.parse_args()
    if options.before is None:
        print("There is no earlier version to compare with; give its checkout with --before PATH.")
        return
    before: list[dict[str, float]] = []
    after: list[dict[str, float]] = []
    for _ in track(range(options.turns), "turns", console=Console(stderr=True)):
        before.append(figures(options.before))
        after.append(figures(options.after))
    table = Table("figure", "before", "after", "ratio", "spread")
    for name in before[0]:
        old, new = [turn[name] for turn in before], [turn[name] for turn in after]
        ratios = sorted(b / a for a, b in zip(old, new, strict=True))
        middle: Callable[[list[float]], float] = statistics.median
        table.add_row(
            name, f"{middle(old):.4f} s", f"{middle(new):.4f} s", f"{middle(new) / middle(old):.2f}",
            f"{ratios[0]:.2f} to {ratios[-1]:.2f}",
        )  # fmt: skip
    Console().print(table)


if __name__ == "__main__":
    main()
