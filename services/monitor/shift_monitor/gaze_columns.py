"""The columns of a gaze chunk: its samples one by one, and their form in a recording. Pure."""

from __future__ import annotations

from typing import Any

from shift_schemas.messages import Gaze, GazeChunk

LOST_EYE = {"pupil_left": 0.0, "pupil_right": 0.0, "openness_left": -1.0, "openness_right": -1.0}
"""What a recording has where a value of an eye is lost: no pupil is of size 0, and a closed eye has the openness 0."""


def points_of(chunk: GazeChunk) -> list[tuple[float, float] | None]:
    """Return the points of a chunk, None for a lost sample. Without ``valid``, a sample that has x and y is valid."""
    xs, ys = chunk.x or [], chunk.y or []
    if chunk.valid is None:
        return [(x, y) if x is not None and y is not None else None for x, y in zip(xs, ys, strict=True)]
    return [
        (x, y) if ok and x is not None and y is not None else None
        for x, y, ok in zip(xs, ys, chunk.valid, strict=True)
    ]  # fmt: skip


def recorded_columns(chunk: GazeChunk) -> dict[str, list[Any]]:
    """Return the chunk's columns as a :class:`Gaze` fact has them.

    '' stands for no AOI. A lost sample is 0, 0 and not valid.
    """
    if chunk.aoi is not None:
        return {"aoi": [name or "" for name in chunk.aoi], **_recorded_eyes(chunk)}
    points = points_of(chunk)
    return {
        "x": [p[0] if p else 0.0 for p in points],
        "y": [p[1] if p else 0.0 for p in points],
        "valid": [p is not None for p in points],
        **_recorded_eyes(chunk),
    }


def _recorded_eyes(chunk: GazeChunk) -> dict[str, list[float]]:
    """Return the columns of the eyes that the chunk has, with numbers where a value is lost."""
    return {
        name: [lost if value is None else value for value in column]
        for name, lost in LOST_EYE.items()
        if (column := getattr(chunk, name)) is not None
    }


def gaze_chunk_of(fact: Gaze) -> GazeChunk:
    """Return the chunk that a fact records; applying it again gives the same facts."""
    eyes: dict[str, Any] = {
        name: [None if value == lost else value for value in column]
        for name, lost in LOST_EYE.items()
        if (column := getattr(fact, name)) is not None
    }
    columns: dict[str, Any] = (
        {"aoi": [name or None for name in fact.aoi]}
        if fact.aoi
        else {"x": list(fact.x), "y": list(fact.y), "valid": fact.valid}
    )
    return GazeChunk(
        source=fact.source, seq=fact.seq, t=fact.t, round_trip_s=fact.round_trip_s, offset_s=fact.offset_s, **columns,
        **eyes,
    )  # fmt: skip
