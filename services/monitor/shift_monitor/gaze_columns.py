"""The columns of a gaze chunk: its samples one by one, and their form in a recording. Pure."""

from __future__ import annotations

from typing import Any

from shift_schemas.messages import Gaze, GazeChunk


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
        return {"aoi": [name or "" for name in chunk.aoi]}
    points = points_of(chunk)
    return {
        "x": [p[0] if p else 0.0 for p in points],
        "y": [p[1] if p else 0.0 for p in points],
        "valid": [p is not None for p in points],
    }


def gaze_chunk_of(fact: Gaze) -> GazeChunk:
    """Return the chunk that a fact records; applying it again gives the same facts."""
    if fact.aoi:
        names = [name or None for name in fact.aoi]
        return GazeChunk(source=fact.source, seq=fact.seq, t=fact.t, aoi=names)
    return GazeChunk(source=fact.source, seq=fact.seq, t=fact.t, x=list(fact.x), y=list(fact.y), valid=fact.valid)
