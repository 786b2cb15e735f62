"""How fast recordings are exported, beside the bare reader of the package ``mcap`` on the same file in the same run.

python benchmarks/export.py
python benchmarks/export.py data/recordings/s1.mcap --turns 5
"""

from __future__ import annotations

import argparse
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from mcap.reader import make_reader
from rich.console import Console
from rich.table import Table
from shift_recording.export.export import export
from shift_recording.export.screen import Screen
from shift_recording.mcap.reader import facts
from shift_schemas.messages import GazeChunk

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from support.verify_sessions import Session

RATE_HZ, MINUTES = 300, 2


def recording(folder: Path) -> Path:
    """Return the recording of a session with steady gaze at 300 Hz."""
    session = Session(seed=1)
    session.deliver()
    for n in range(RATE_HZ * 60 * MINUTES // 10):
        t = [(10 * n + i) / RATE_HZ for i in range(10)]
        points = [0.3 + (n % 7) / 20] * 10
        session.do("monitor", GazeChunk(source="tx300", seq=n, t=t, x=points, y=points, valid=[True] * 10))
    return session.ended().finished(folder)


def bare(path: Path) -> None:
    """Read every message without looking into it."""
    with open(path, "rb") as stream:
        for _ in make_reader(stream).iter_messages():
            pass


def main() -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", nargs="?", type=Path, help="Left out: two minutes of gaze at 300 Hz.")
    parser.add_argument("--turns", type=int, default=3, help="How often each is measured.")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        path, out = options.file or recording(Path(folder)), Path(folder) / "out"
        programs: dict[str, Callable[[], Any]] = {
            "bare mcap reader": lambda: bare(path),
            "reading and checking (ours)": lambda: sum(1 for _ in facts(path)),
            "csv": lambda: export([path], "csv", out / "csv"),
            "parquet": lambda: export([path], "parquet", out / "parquet"),
            "bids": lambda: export([path], "bids", out / "bids", screen=Screen(1920, 1080)),
        }
        programs["parquet"]()  # pyarrow is imported once
        times: dict[str, list[float]] = {name: [] for name in programs}
        for _ in range(options.turns):
            for name, program in programs.items():
                begun = time.perf_counter()
                program()
                times[name].append(time.perf_counter() - begun)
    reference = times["bare mcap reader"]
    table = Table("program", "seconds", "of the bare reader's rate", "spread")
    for name, seconds in times.items():
        ratios = sorted(r / s for r, s in zip(reference, seconds, strict=True))
        middle = f"{statistics.median(ratios):.2f}"
        table.add_row(name, f"{statistics.median(seconds):.2f}", middle, f"{ratios[0]:.2f} to {ratios[-1]:.2f}")
    Console().print(table)


if __name__ == "__main__":
    main()
