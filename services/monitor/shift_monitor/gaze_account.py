"""What became of a gaze source's time: lost, off the stimulus, in no fixation, on no AOI or on one. Pure.

Time is that of the source's clock, from its first sample on, in integer nanoseconds. The time between two samples
is lost as far as the earlier one does not stand for it (MODEL.md, section 1). A jump forward is no time.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

JUMP_NS = 60_000_000_000
"""Chosen: a sample that comes more than a minute after the one before it tells of a jump or of a break."""

LOST, ON_STIMULUS, OFF_STIMULUS = 0, 1, 2
"""What a sample is: lost, a point on the stimulus or an AOI name, a point beside the stimulus."""


class GazeAccount(NamedTuple):
    """Time of one source, ns, all its segments together."""

    total_ns: int = 0
    covered_ns: int = 0
    """Valid samples stand for it."""
    off_stimulus_ns: int = 0
    on_aoi_ns: int = 0
    off_aoi_ns: int = 0
    last_ns: int | None = None
    """Time of the last sample of this segment."""
    standing: int = LOST
    """What that sample is."""
    samples: int = 0


def counted(account: GazeAccount, times: Sequence[int], standings: Iterable[int], longest_ns: int) -> GazeAccount:
    """Return the account after these samples, each of which stands until the next one, at most ``longest_ns``."""
    total_ns, covered_ns, off_stimulus_ns = account.total_ns, account.covered_ns, account.off_stimulus_ns
    last_ns, standing = account.last_ns, account.standing
    for t_ns, this in zip(times, standings, strict=True):
        if last_ns is not None and (passed_ns := t_ns - last_ns) <= JUMP_NS:
            total_ns += passed_ns
            if standing != LOST:
                stood_ns = passed_ns if passed_ns < longest_ns else longest_ns
                covered_ns += stood_ns
                if standing == OFF_STIMULUS:
                    off_stimulus_ns += stood_ns
        last_ns, standing = t_ns, this
    return account._replace(
        total_ns=total_ns, covered_ns=covered_ns, off_stimulus_ns=off_stimulus_ns, last_ns=last_ns, standing=standing,
        samples=account.samples + len(times),
    )  # fmt: skip


def dwelt(account: GazeAccount, on_aoi_ns: int, off_aoi_ns: int) -> GazeAccount:
    """Return the account after so much dwell on an AOI and on none."""
    return account._replace(
        on_aoi_ns=account.on_aoi_ns + on_aoi_ns, off_aoi_ns=account.off_aoi_ns + off_aoi_ns
    )  # fmt: skip


def broken_off(account: GazeAccount) -> GazeAccount:
    """Return the account before another segment: the last sample stands for nothing more."""
    return account._replace(last_ns=None, standing=LOST)


class Shares(NamedTuple):
    """Shares of the source's time, 0..1; all 0 before there is any."""

    lost: float
    unclassified: float
    off_aoi: float
    off_stimulus: float


def shares(account: GazeAccount) -> Shares:
    """Return the shares; what was not lost, in no fixation yet, is unclassified."""
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
