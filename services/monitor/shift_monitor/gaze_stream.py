"""The gaze stream: what the samples of one source, points or AOI names, leave in the partner model. Pure.

Sample by sample, so that the cut of chunks cannot matter.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

from shift_schemas.errors import FieldError, MalformedMessage, shorten
from shift_schemas.messages import GazeChunk
from shift_schemas.suggestions import did_you_mean
from shift_schemas.timestamps import NS

from shift_monitor.areas import NOWHERE, area_at
from shift_monitor.attention import Attention, Dwell, dwelt, met_aoi
from shift_monitor.chunk_sequence import Numbering
from shift_monitor.fixation import Detector, Found, Output, fed
from shift_monitor.gaze_account import LOST, OFF_STIMULUS, ON_STIMULUS, GazeAccount
from shift_monitor.gaze_account import counted as time_counted
from shift_monitor.gaze_account import dwelt as account_dwelt
from shift_monitor.prepared_study import Plan

LEAST_COORDINATE, LARGEST_COORDINATE = -1.0, 2.0
"""Chosen: gaze up to one stimulus beside the stimulus is gaze; beyond, the unit is wrong or the sample lost."""


UNREAD, IDLE, NO_TIME = Numbering(), Detector(), GazeAccount()
"""A source of which nothing was read."""


@dataclass(frozen=True, slots=True)
class Stream:
    """The gaze source that speaks."""

    source: str
    numbering: Numbering = UNREAD
    last_ns: int | None = None
    """Time of its last sample."""
    named: int | None = None
    """The last sample's target where it was an AOI name; none: it was a point."""
    detector: Detector = IDLE
    segment: int = 0
    """One more with each restart of its clock or its numbering."""
    account: GazeAccount = NO_TIME
    spacings: tuple[int, ...] = ()
    """The last spacings of its samples, ns."""


def points_applied(
    stream: Stream, attention: Attention, times: list[int], chunk: GazeChunk, plan: Plan
) -> tuple[Stream, Attention, list[Found]]:
    """Points through fixation detection, sample by sample; only what is inside a fixation is dwell."""
    found: list[Found] = []
    detector, account = stream.detector, stream.account
    standings: list[int] = []
    for t_ns, point in zip(times, points_of(chunk), strict=True):
        standings.append(_standing(point))
        if not attention.met and point is not None and area_at(plan.areas, *point) != NOWHERE:
            attention = met_aoi(attention)
        detector, output = fed(detector, t_ns, point, plan.rule)
        if output.dwells:
            attention, account = dwelt_on(attention, account, output, plan)
        found += output.found
    account = time_counted(account, times, standings, plan.rule.gap_ns)
    return replace(stream, last_ns=times[-1], named=None, detector=detector, account=account), attention, found


def _standing(point: tuple[float, float] | None) -> int:
    if point is None:
        return LOST
    return ON_STIMULUS if 0.0 <= point[0] <= 1.0 and 0.0 <= point[1] <= 1.0 else OFF_STIMULUS


def dwelt_on(attention: Attention, account: GazeAccount, output: Output, plan: Plan) -> tuple[Attention, GazeAccount]:
    """The dwell of the samples inside a fixation, each on the AOI that its filtered position falls on."""
    rule, settings = plan.rule, plan.study.attention
    on_aoi_ns = off_aoi_ns = 0
    for t_ns, x, y, duration_ns in output.dwells:
        target = area_at(plan.areas, x, y)
        if target == NOWHERE:
            off_aoi_ns += duration_ns
        else:
            on_aoi_ns += duration_ns
        attention = dwelt(attention, Dwell(target, t_ns, duration_ns), rule.minimum_ns, rule.gap_ns, settings)
    return attention, account_dwelt(account, on_aoi_ns, off_aoi_ns)


def names_applied(
    stream: Stream, attention: Attention, times: list[int], names: list[str | None], plan: Plan
) -> tuple[Stream, Attention]:
    """AOI names as they are: each stands until the next, at most ``attention.maximum_dwell_s``."""
    last_ns, named = stream.last_ns, stream.named
    on_aoi_ns = off_aoi_ns = 0
    for t_ns, name in zip(times, names, strict=True):
        if last_ns is not None and named is not None:
            dwell = Dwell(named, last_ns, min(t_ns - last_ns, plan.longest_ns))
            if named == NOWHERE:
                off_aoi_ns += dwell.duration_ns
            else:
                on_aoi_ns += dwell.duration_ns
            attention = dwelt(attention, dwell, plan.rule.minimum_ns, 0, plan.study.attention)
        last_ns, named = t_ns, plan.targets[name]
        if not attention.met and named != NOWHERE:
            attention = met_aoi(attention)
    account = time_counted(stream.account, times, [ON_STIMULUS] * len(times), plan.longest_ns)
    account = account_dwelt(account, on_aoi_ns, off_aoi_ns)
    return replace(stream, last_ns=last_ns, named=named, account=account), attention


def points_of(chunk: GazeChunk) -> Iterator[tuple[float, float] | None]:
    """The points of a chunk; none where the sample is lost. Left out, ``valid`` is: where x and y are."""
    valid: list[bool] = chunk.valid if chunk.valid is not None else [True] * len(chunk.t)
    for x, y, ok in zip(chunk.x or [], chunk.y or [], valid, strict=True):
        yield (x, y) if ok and x is not None and y is not None else None


def recorded_columns(chunk: GazeChunk) -> dict[str, list[Any]]:
    """Return the chunk's columns as a :class:`Gaze` fact has them: '' is no AOI, a lost sample 0, 0, invalid."""
    if chunk.aoi is not None:
        return {"aoi": [name or "" for name in chunk.aoi]}
    points = list(points_of(chunk))
    return {
        "x": [p[0] if p else 0.0 for p in points],
        "y": [p[1] if p else 0.0 for p in points],
        "valid": [p is not None for p in points],
    }


# --- what is refused ---


def check_samples(chunk: GazeChunk, plan: Plan) -> None:
    if chunk.aoi is not None:
        unknown = next(((i, n) for i, n in enumerate(chunk.aoi) if n not in plan.targets), None)
        if unknown is not None:
            meant = did_you_mean(unknown[1], plan.names)
            rule = f"one of: {', '.join(plan.names)}; or null for none of them{meant}"
            raise _malformed(f"aoi.{unknown[0]}", unknown[1], rule)
    for name, column in (("x", chunk.x), ("y", chunk.y)):
        for i, value in enumerate(column or ()):
            if value is None or LEAST_COORDINATE <= value <= LARGEST_COORDINATE:
                continue
            if chunk.valid is None or chunk.valid[i]:
                raise _malformed(f"{name}.{i}", value, COORDINATE_RULE)


COORDINATE_RULE = (
    "a coordinate is a share of the stimulus, 0..1 from the upper left corner, and at most -1..2 beside it: divide "
    "pixels by the stimulus' width or height and percent by 100; write null where gaze is lost"
)


def check_rise(last_ns: int | None, times: list[int], chunk: GazeChunk) -> None:
    """Raise :class:`MalformedMessage` where a sample is not later than the one before it, in whole nanoseconds."""
    for i, t_ns in enumerate(times):
        if last_ns is not None and t_ns <= last_ns:
            rule = f"t must rise by 1 ns or more; the sample before was at {last_ns / NS} s, {chunk.source}'s clock"
            raise _malformed("t" if i == 0 else f"t.{i}", chunk.t[i], rule)
        last_ns = t_ns


def _malformed(name: str, value: object, rule: str) -> MalformedMessage:
    error = FieldError(field=name, value=shorten(value), rule=rule)
    return MalformedMessage(f"gaze: {name}: {error.value}: {rule}", (error,))
