"""Warnings about gaze that is accepted but is probably a mistake or can have no effect. Pure.

A warning changes nothing of the model. It is part of the reply, of the recording and of the observation.
Recordings are verified word for word, so the wording of a warning must not change.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from statistics import median_low

from shift_schemas.timestamps import NS

from shift_monitor.gaze_account import JUMP_NS, GazeAccount, shares

WINDOW = 16
"""Chosen: the number of sample spacings that are kept; their median gives the rate, which single gaps do not change."""
ENOUGH = 4
"""Chosen: fewer spacings cause no warning."""
SLOWEST_HZ, FASTEST_HZ = 1.0, 20_000.0
"""Chosen: no eye tracker is slower or faster; the fastest on the market samples at 2 kHz."""
MOST = 0.5
"""Chosen: a larger share of lost or off-stimulus time causes a warning."""
EARLIEST_NS = NS // 2
"""Chosen: shares can cause a warning after this much time, or after ten samples."""


def next_spacings(before: Sequence[int], last_ns: int | None, times: Sequence[int]) -> tuple[int, ...]:
    """Return the last spacings of samples, ns, after a chunk with these times."""
    recent = times[-WINDOW - 1 :]
    joined = recent if last_ns is None or len(times) > WINDOW else [last_ns, *recent]
    found = [b - a for a, b in pairwise(joined)]
    return (*before, *found)[-WINDOW:]


def jump_warnings(last_ns: int | None, first_ns: int) -> list[str]:
    """Return the warning about a clock that jumped forward, if it did."""
    if last_ns is None or first_ns - last_ns <= JUMP_NS:
        return []
    return [f"the source's time jumps forward by {_s(first_ns - last_ns)} s; no gaze is assumed in between"]


def rate_warnings(spacings: Sequence[int], points: bool, gap_ns: int) -> list[str]:
    """Return warnings about an implausible rate and about points that can never form a fixation."""
    if len(spacings) < ENOUGH:
        return []
    spacing_ns = median_low(spacings)
    rate_hz = NS / spacing_ns
    found = []
    if rate_hz > FASTEST_HZ or (points and rate_hz < SLOWEST_HZ):
        found.append(
            f"samples come every {_s(spacing_ns)} s by their times, which is {rate_hz:.4g} Hz: no eye tracker does "
            "that; t must be in seconds, so divide milliseconds by 1000"
        )
    if points and spacing_ns > 2 * gap_ns:
        found.append(
            f"points {_s(spacing_ns)} s apart can never make a fixation, so this gaze has no effect: they must be at "
            f"most {_s(2 * gap_ns)} s apart (twice fixation.maximum_gap_s); send a faster rate, or AOI names"
        )
    return found


def share_warnings(account: GazeAccount, points: bool, longest_ns: int) -> list[str]:
    """Return warnings about gaze that is mostly lost or off the stimulus; a sample stands for ``longest_ns``."""
    if account.samples < (ENOUGH if account.total_ns >= EARLIEST_NS else 10):
        return []
    found, share = [], shares(account)
    if share.lost > MOST:
        why = "check the tracker" if points else "a source of AOI names must speak at least so often"
        found.append(
            f"{share.lost:.0%} of the source's time is lost: no valid sample stands for it, and each stands for at "
            f"most {_s(longest_ns)} s; {why}"
        )
    if share.off_stimulus > MOST:
        found.append(
            f"{share.off_stimulus:.0%} of the source's time is off the stimulus: x or y is outside 0..1; check the "
            "units, the calibration and the value that the tracker gives for loss (null or valid: false is right)"
        )
    return found


def clock_restart_warning(source: str, before_ns: int, first_ns: int, segment: int) -> str:
    """Return the warning about a clock that went back."""
    return (
        f"the time of gaze source {source} goes back from {_s(before_ns)} to {_s(first_ns)} s: segment {segment} of "
        "the source begins"
    )


def clock_jump_warning(source: str, before_ns: int, first_ns: int, segment: int) -> str:
    """Return the warning about a clock that was set forward."""
    return (
        f"the time of gaze source {source} jumps from {_s(before_ns)} to {_s(first_ns)} s, and less time passed here: "
        f"segment {segment} of the source begins"
    )


def number_restart_warning(source: str, before: int, seq: int, segment: int) -> str:
    """Return the warning about a numbering that began again."""
    return (
        f"gaze source {source} sends another chunk {seq} after chunk {before}: segment {segment} of the source begins"
    )


def late_warning(seq: int, last: int) -> str:
    """Return the warning about a late chunk."""
    return f"chunk {seq} comes after chunk {last}: it is recorded and not applied"


def _s(ns: int) -> str:
    return f"{ns / NS:.9f}".rstrip("0").rstrip(".")
