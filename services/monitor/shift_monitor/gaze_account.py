"""How the time of a gaze source divides: lost, off the stimulus, in no fixation, on no AOI, on an AOI. Pure.

Time is counted in integer nanoseconds on the source's clock, from its first sample on. The time between two samples
is lost as far as the earlier one does not stand for it (docs/model.md). A jump forward counts as no time.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

JUMP_NS = 60_000_000_000
"""Chosen: a sample more than a minute after the one before it means that the clock jumped or the source paused."""

LOST, ON_STIMULUS, OFF_STIMULUS = 0, 1, 2
"""The kinds of samples: lost; a point on the stimulus or an AOI name; a point beside the stimulus."""


class GazeAccount(NamedTuple):
    """The time of one source in ns, summed over all its segments."""

    total_ns: int = 0
    covered_ns: int = 0
    """The time that valid samples stand for."""
    off_stimulus_ns: int = 0
    on_aoi_ns: int = 0
    off_aoi_ns: int = 0
    last_ns: int | None = None
    """The time of the last sample of this segment."""
    kind: int = LOST
    """The kind of that sample."""
    samples: int = 0


EMPTY_ACCOUNT = GazeAccount()


def count_samples(account: GazeAccount, times: Sequence[int], kinds: Iterable[int], longest_ns: int) -> GazeAccount:
    """Return the account after these samples, each of which stands until the next one, at most ``longest_ns``."""
    total_ns, covered_ns, off_stimulus_ns = account.total_ns, account.covered_ns, account.off_stimulus_ns
    last_ns, kind = account.last_ns, account.kind
    for t_ns, this in zip(times, kinds, strict=True):
        if last_ns is not None and (passed_ns := t_ns - last_ns) <= JUMP_NS:
            total_ns += passed_ns
            if kind != LOST:
                stands_ns = passed_ns if passed_ns < longest_ns else longest_ns
                covered_ns += stands_ns
                if kind == OFF_STIMULUS:
                    off_stimulus_ns += stands_ns
        last_ns, kind = t_ns, this
    return account._replace(
        total_ns=total_ns, covered_ns=covered_ns, off_stimulus_ns=off_stimulus_ns, last_ns=last_ns, kind=kind,
        samples=account.samples + len(times),
    )  # fmt: skip


def count_dwell(account: GazeAccount, on_aoi_ns: int, off_aoi_ns: int) -> GazeAccount:
    """Return the account after this much dwell on an AOI and on none."""
    return account._replace(
        on_aoi_ns=account.on_aoi_ns + on_aoi_ns, off_aoi_ns=account.off_aoi_ns + off_aoi_ns
    )  # fmt: skip


def end_segment(account: GazeAccount) -> GazeAccount:
    """Return the account before another segment: the last sample stands for no more time."""
    return account._replace(last_ns=None, kind=LOST)


class Shares(NamedTuple):
    """Shares of the source's time (0..1); all are 0 while there is no time."""

    lost: float
    unclassified: float
    off_aoi: float
    off_stimulus: float


def shares(account: GazeAccount) -> Shares:
    """Return the shares; time that is neither lost nor in a fixation yet is unclassified."""
    total = account.total_ns
    if not total:
        return Shares(0.0, 0.0, 0.0, 0.0)
    unclassified = max(account.covered_ns - account.on_aoi_ns - account.off_aoi_ns, 0)
    return Shares(
        lost=(total - account.covered_ns) / total,
        unclassified=unclassified / total,
        off_aoi=account.off_aoi_ns / total,
        off_stimulus=account.off_stimulus_ns / total,
    )
