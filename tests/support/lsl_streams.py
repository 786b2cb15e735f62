"""Real streams of Lab Streaming Layer for tests: outlets in a process of their own, on loopback only.

    python tests/support/lsl_streams.py gaze --name Eyes --rate 1200 --count 6000

It prints a line of JSON for each thing that it did: the number of the first and of the last sample.
"""

from __future__ import annotations

import argparse
import json
import math
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

CONFIG = """[ports]
IPv6 = disable
[multicast]
ResolveScope = machine
ListenAddress = 127.0.0.1
[lab]
KnownPeers = {127.0.0.1}
[log]
level = -3
"""
"""liblsl's configuration: nothing leaves this computer."""


def environment(folder: Path) -> dict[str, str]:
    """Return the environment of processes whose streams stay on this computer."""
    import os

    path = folder / "lsl_api.cfg"
    path.write_text(CONFIG)
    return {**os.environ, "LSLAPICFG": str(path)}


@contextmanager
def outlet(folder: Path, *words: str) -> Iterator[subprocess.Popen[str]]:
    """Run an outlet until the end of the context."""
    line = [sys.executable, __file__, *words]
    process = subprocess.Popen(line, stdout=subprocess.PIPE, text=True, env=environment(folder))
    try:
        yield process
    finally:
        process.kill()
        process.wait()


def point(number: int) -> tuple[float, float]:
    """Return where sample ``number`` is: it tells its number."""
    return 0.1 + 0.8 * (number % 1000) / 1000, 0.1 + 0.8 * (number // 1000 % 1000) / 1000


def number_of(x: float, y: float) -> int:
    """Return the number of the sample at a point."""
    return round((x - 0.1) / 0.8 * 1000) + 1000 * round((y - 0.1) / 0.8 * 1000)


def _channels(info: Any, channels: Sequence[dict[str, str]]) -> None:
    described = info.desc().append_child("channels")
    for channel in channels:
        each = described.append_child("channel")
        for name, value in channel.items():
            each.append_child_value(name, value)


GAZE = ({"label": "x", "type": "ScreenX", "eye": "both", "unit": "normalized"},
        {"label": "y", "type": "ScreenY", "eye": "both", "unit": "normalized"},
        {"label": "confidence", "type": "Confidence"},
        {"label": "object", "type": "ObjectId"})  # fmt: skip


def _gaze(options: argparse.Namespace) -> None:
    import pylsl

    info = pylsl.StreamInfo(options.name, "Gaze", len(GAZE), options.rate, "double64", options.source_id)
    _channels(info, GAZE)
    stream = pylsl.StreamOutlet(info, chunk_size=10)
    if not stream.wait_for_consumers(60):
        sys.exit("nobody listens")
    begun = pylsl.local_clock()
    for i in range(options.count):
        number = options.first + i
        due = begun + i / options.rate
        while (left := due - pylsl.local_clock()) > 0:
            time.sleep(min(left, 0.01))
        x, y = point(number)
        step = options.step if i >= options.step_at else 0.0
        stream.push_sample(
            [x, y, 0.3 if options.lost and i % options.lost == 0 else 1.0, float(i // 100 % 2)], due + step
        )
    print(json.dumps({"first": options.first, "last": options.first + options.count - 1}), flush=True)
    time.sleep(options.stay)


def _texts(options: argparse.Namespace) -> None:
    import pylsl

    info = pylsl.StreamInfo(options.name, "Markers", 1, pylsl.IRREGULAR_RATE, "string", options.source_id)
    stream = pylsl.StreamOutlet(info)
    if not stream.wait_for_consumers(60):
        sys.exit("nobody listens")
    for text in options.texts:
        stream.push_sample([text])
        time.sleep(options.pause)
    print(json.dumps({"sent": len(options.texts)}), flush=True)
    time.sleep(options.stay)


def main() -> None:
    """Run one outlet."""
    parser = argparse.ArgumentParser()
    parser.add_argument("kind", choices=["gaze", "texts"])
    parser.add_argument("texts", nargs="*")
    parser.add_argument("--name", default="Eyes")
    parser.add_argument("--source-id", default="test-eyes")
    parser.add_argument("--rate", type=float, default=300.0)
    parser.add_argument("--count", type=int, default=600)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--step", type=float, default=0.0)
    parser.add_argument("--step-at", type=float, default=math.inf)
    parser.add_argument("--lost", type=int, default=0)
    parser.add_argument("--pause", type=float, default=0.3)
    parser.add_argument("--stay", type=float, default=60.0)
    options = parser.parse_args()
    (_gaze if options.kind == "gaze" else _texts)(options)


if __name__ == "__main__":
    main()
