"""Measure Table II (twelve rows of 500 runs of 100 episodes): vectorised, and as a plain Python loop.

The loop has the same random numbers and rules, and computes one run after the other. It computes only a part of the
runs, and its time is scaled up. Both take turns, so that a busy machine slows both.

    python benchmarks/table2.py [--repeats 5]

The exit code is 1 if the vectorised form takes 1 s of computing or more, or more than 0.2 of the loop's time.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from collections.abc import Callable
from math import exp

from shift_model.random_numbers import pick, uniform
from shift_simulator.random_streams import (
    COIN,
    DEVIATES,
    GAZE_CLASS,
    GAZE_KEPT,
    T_COMPREHENSION,
    T_ENABLEDNESS,
    TASK,
    session_seed,
)
from shift_simulator.table2 import EPISODES, PAPER, Setting, table2
from shift_simulator.users import DURATIONS
from shift_study.scoring import suggestions
from shift_study.study import Study

RUNS = 500
LOOPED = 10
"""Runs of each row that the plain loop computes."""
LARGEST_SHARE = 0.2
LARGEST_SECONDS = 1.0


def plain(seed: int, runs: int) -> list[float]:
    """Return the mean reward of each row, by a loop in plain Python."""
    suggested = suggestions(Study(study="s").scoring)
    return [sum(session(session_seed(seed, r), s, suggested) for r in range(runs)) / runs for s in PAPER]


def session(seed: int, setting: Setting, suggested: tuple[int, ...]) -> float:
    """Return the cumulative reward of one session of the paper's learner with user A."""
    values = [[float(setting.prior and a == s) for a in range(6)] for s in range(6)]
    tried: set[int] = set()
    capacity, previous, gaze, total = 1.0, -1, 2, 0.0
    awareness = [0, 0, 0]
    pending: tuple[int, int, float] | None = None
    for n in range(1, EPISODES + 1):
        task = int(uniform(seed, n, TASK) * 3)
        if n > 1 and uniform(seed, n, GAZE_KEPT) >= 0.3:
            gaze = int(uniform(seed, n, GAZE_CLASS) * 3)
        state = suggested[15 * (capacity >= 0.5 - 1e-9) + 5 * gaze + awareness[task]]
        row = values[state]
        if pending is not None:
            s, a, reward = pending
            target = reward + setting.discount * max(row)
            values[s][a] += setting.learning_rate * (target - values[s][a])
        epsilon = 0.75 * max(0.0, 1.0 - (n - 1) / 100)
        candidates = [a for a in range(6) if a not in tried] or list(range(6))
        probabilities = [epsilon / len(candidates) if a in candidates else 0.0 for a in range(6)]
        probabilities[row.index(max(row))] += 1.0 - epsilon
        action = pick(probabilities, uniform(seed, n))
        tried.add(action)
        success = action == state
        if uniform(seed, n, DEVIATES) < 0.05:
            success = uniform(seed, n, COIN) < 0.5
        durations = [DURATIONS[int(uniform(seed, n, stream) * 5)] for stream in (T_COMPREHENSION, T_ENABLEDNESS)]
        reward = sum((1 if success else -1) * exp(-0.1 * t) for t in durations) / 2
        total += reward
        pending = (state, action, reward)
        awareness[task] = 4 if success else 1
        cost = 0.1 if action < 2 else 0.2
        capacity = min(capacity + 0.3, 1.0) if action == previous else max(capacity - cost, 0.0)
        previous = action
    return total


def seconds(work: Callable[[], object]) -> float:
    """Return the computing time of the work in this process, s."""
    start = time.process_time()
    work()
    return time.process_time() - start


def main() -> int:
    """Measure and print; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeats", type=int, default=5)
    repeats = parser.parse_args().repeats
    ours = [row["r_mean"] for row in table2(1, LOOPED)["rows"]]
    if any(abs(a - b) > 1e-9 for a, b in zip(ours, plain(1, LOOPED), strict=True)):
        print("the two forms do not agree")
        return 1
    fast, slow = [], []
    for seed in range(repeats):
        fast.append(seconds(lambda seed=seed: table2(seed, RUNS)))  # type: ignore[misc]
        slow.append(seconds(lambda seed=seed: plain(seed, LOOPED)) * RUNS / LOOPED)  # type: ignore[misc]
    shares = [f / s for f, s in zip(fast, slow, strict=True)]
    print(f"vectorised    {summary(fast)} s of computing for 12 x {RUNS} x {EPISODES}")
    print(f"plain loop    {summary(slow)} s ({LOOPED} runs a row, scaled up)")
    print(f"share         {summary(shares)} (at most {LARGEST_SHARE})")
    return int(statistics.median(fast) >= LARGEST_SECONDS or statistics.median(shares) > LARGEST_SHARE)


def summary(values: list[float]) -> str:
    """Return the median and the range as text."""
    return f"{statistics.median(values):.3f} ({min(values):.3f} to {max(values):.3f})"


if __name__ == "__main__":
    sys.exit(main())
