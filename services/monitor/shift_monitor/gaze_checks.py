"""Checks of a gaze chunk that depend on the study or on the source's earlier gaze. Pure."""

from __future__ import annotations

from shift_schemas.errors import FieldError, MalformedMessage, shorten
from shift_schemas.messages import GazeChunk
from shift_schemas.suggestions import did_you_mean
from shift_schemas.timestamps import NS

from shift_monitor.prepared_study import PreparedStudy

LEAST_COORDINATE, LARGEST_COORDINATE = -1.0, 2.0
"""Chosen: gaze may be up to one stimulus beside the stimulus; beyond, the unit is wrong or the sample is lost."""

COORDINATE_RULE = (
    "a coordinate is a share of the stimulus, 0..1 from the upper left corner, and at most -1..2 beside it: divide "
    "pixels by the stimulus' width or height and percent by 100; write null where gaze is lost"
)


def check_samples(chunk: GazeChunk, prepared: PreparedStudy) -> None:
    """Raise :class:`MalformedMessage` for an AOI that the study does not have or a coordinate out of range."""
    if chunk.aoi is not None:
        unknown = next(((i, n) for i, n in enumerate(chunk.aoi) if n not in prepared.targets), None)
        if unknown is not None:
            meant = did_you_mean(unknown[1], prepared.names)
            rule = f"one of: {', '.join(prepared.names)}; or null for none of them{meant}"
            raise _malformed(f"aoi.{unknown[0]}", unknown[1], rule)
    for name, column in (("x", chunk.x), ("y", chunk.y)):
        for i, value in enumerate(column or ()):
            if value is None or LEAST_COORDINATE <= value <= LARGEST_COORDINATE:
                continue
            if chunk.valid is None or chunk.valid[i]:
                raise _malformed(f"{name}.{i}", value, COORDINATE_RULE)


def check_rise(last_ns: int | None, times: list[int], chunk: GazeChunk) -> None:
    """Raise :class:`MalformedMessage` if a sample is not later than the one before it, in whole nanoseconds."""
    for i, t_ns in enumerate(times):
        if last_ns is not None and t_ns <= last_ns:
            rule = f"t must rise by 1 ns or more; the sample before was at {last_ns / NS} s, {chunk.source}'s clock"
            raise _malformed("t" if i == 0 else f"t.{i}", chunk.t[i], rule)
        last_ns = t_ns


def _malformed(name: str, value: object, rule: str) -> MalformedMessage:
    error = FieldError(field=name, value=shorten(value), rule=rule)
    return MalformedMessage(f"gaze: {name}: {error.value}: {rule}", (error,))
