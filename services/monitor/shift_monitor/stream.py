"""The gaze stream: what the samples of one source, points or AOI names, leave in the partner model. Pure.

Sample by sample, so that the cut of chunks cannot matter.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from shift_schemas.errors import FieldError, MalformedMessage, shorten
from shift_schemas.hints import did_you_mean
from shift_schemas.messages import GazeChunk
from shift_schemas.stamps import NS

from shift_monitor.areas import NOWHERE, area_at
from shift_monitor.attention import Attention, Dwell, dwelt, met_aoi
from shift_monitor.fixation import Detector, Found, Output, fed
from shift_monitor.numbering import Numbering
from shift_monitor.plan import Plan

LARGEST_COORDINATE = 100.0
"""Chosen: gaze beside the screen is gaze; a hundred screens beside it is nonsense."""


UNREAD, IDLE = Numbering(), Detector()
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


def points_applied(
    stream: Stream, attention: Attention, times: list[int], chunk: GazeChunk, plan: Plan
) -> tuple[Stream, Attention, list[Found]]:
    """Points through fixation detection, sample by sample; only what is inside a fixation is dwell."""
    found: list[Found] = []
    detector = stream.detector
    for t_ns, point in zip(times, points_of(chunk), strict=True):
        if not attention.met and point is not None and area_at(plan.areas, *point) != NOWHERE:
            attention = met_aoi(attention)
        detector, output = fed(detector, t_ns, point, plan.rule)
        attention = dwelt_on(attention, output, plan)
        found += output.found
    return Stream(stream.source, stream.numbering, times[-1], None, detector), attention, found


def dwelt_on(attention: Attention, output: Output, plan: Plan) -> Attention:
    """The dwell of the samples inside a fixation, each on the AOI that its filtered position falls on."""
    rule, settings = plan.rule, plan.study.attention
    for t_ns, x, y, duration_ns in output.dwells:
        dwell = Dwell(area_at(plan.areas, x, y), t_ns, duration_ns)
        attention = dwelt(attention, dwell, rule.minimum_ns, rule.gap_ns, settings)
    return attention


def names_applied(
    stream: Stream, attention: Attention, times: list[int], names: list[str | None], plan: Plan
) -> tuple[Stream, Attention]:
    """AOI names as they are: each stands until the next, at most ``attention.maximum_dwell_s``."""
    last_ns, named = stream.last_ns, stream.named
    for t_ns, name in zip(times, names, strict=True):
        if last_ns is not None and named is not None:
            dwell = Dwell(named, last_ns, min(t_ns - last_ns, plan.longest_ns))
            attention = dwelt(attention, dwell, plan.rule.minimum_ns, 0, plan.study.attention)
        last_ns, named = t_ns, plan.targets[name]
        if not attention.met and named != NOWHERE:
            attention = met_aoi(attention)
    return Stream(stream.source, stream.numbering, last_ns, named, stream.detector), attention


def points_of(chunk: GazeChunk) -> Iterator[tuple[float, float] | None]:
    """The points of a chunk; none where the sample is lost. Left out, ``valid`` is: where x and y are."""
    valid: list[bool] = chunk.valid if chunk.valid is not None else [True] * len(chunk.t)
    for x, y, ok in zip(chunk.x or [], chunk.y or [], valid, strict=True):
        yield (x, y) if ok and x is not None and y is not None else None


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
            if value is not None and not -LARGEST_COORDINATE <= value <= LARGEST_COORDINATE:
                raise _malformed(f"{name}.{i}", value, "0..1 on the stimulus, and null where gaze is lost")


def check_rise(last_ns: int | None, times: list[int], chunk: GazeChunk) -> None:
    for i, t_ns in enumerate(times):
        if last_ns is not None and t_ns <= last_ns:
            rule = f"t must rise; the sample before was at {last_ns / NS} s, {chunk.source}'s clock"
            raise _malformed("t" if i == 0 else f"t.{i}", chunk.t[i], rule)
        last_ns = t_ns


def _malformed(name: str, value: object, rule: str) -> MalformedMessage:
    error = FieldError(field=name, value=shorten(value), rule=rule)
    return MalformedMessage(f"gaze: {name}: {error.value}: {rule}", (error,))
