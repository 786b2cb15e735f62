"""How many of a source's last samples were valid. Pure.

Samples are counted in steps of a tenth of a second of the source's clock, so that the count is small and the cut of
chunks does not change it.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from typing import NamedTuple

STEP_NS = 100_000_000
STEPS = 20
"""Two seconds, as a decision states it."""


class RecentSamples(NamedTuple):
    """The counts of the last steps, oldest first."""

    last: int = 0
    """The number of the newest step: its time divided by :data:`STEP_NS`."""
    counts: tuple[tuple[int, int], ...] = ()
    """For each step, the samples and the valid ones."""


NO_SAMPLES = RecentSamples()


def count_recent(recent: RecentSamples, times: Sequence[int], valid: Sequence[bool]) -> RecentSamples:
    """Return the counts after these samples; ``times`` are in ns, rise, and follow all samples before."""
    last, counts = recent.last, list(recent.counts)
    begin, total = 0, len(times)
    while begin < total:
        step = times[begin] // STEP_NS
        end = bisect_left(times, (step + 1) * STEP_NS, begin)
        if not counts:
            counts, last = [(0, 0)], step
        elif step > last:
            counts = [*counts, *[(0, 0)] * min(step - last, STEPS)][-STEPS:]
            last = step
        samples, valid_ones = counts[-1]
        counts[-1] = (samples + end - begin, valid_ones + sum(valid[begin:end]))
        begin = end
    return RecentSamples(last, tuple(counts))


def valid_share(recent: RecentSamples) -> float | None:
    """Return the share of valid samples (0..1), or None without samples."""
    samples = sum(count for count, _ in recent.counts)
    return sum(valid for _, valid in recent.counts) / samples if samples else None
