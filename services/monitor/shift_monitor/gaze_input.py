"""A chunk of gaze with what was recorded under its number before: what tells a repeat from a restart. Pure.

The same content under the same number of a source is a repeat, however long ago it was first sent.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import NamedTuple

from shift_schemas.messages import Fact, Gaze, GazeChunk

from shift_monitor.gaze_stream import recorded_columns

Recall = Callable[..., Iterable[Fact]]
"""``recall(subject, **fields)``: the session's own facts of a subject whose fields have these values."""

COLUMNS = ("x", "y", "valid", "aoi")


class Earlier(NamedTuple):
    """What was recorded under a source's number. Without ``columns`` it is known to be another content."""

    segment: int
    accepted: int = 0
    warnings: tuple[str, ...] = ()
    columns: tuple[list[float], dict[str, list[object]]] | None = None
    """t, and the other columns by name."""


class GazeInput(NamedTuple):
    """A chunk, and what was recorded under its source and number, oldest first."""

    chunk: GazeChunk
    earlier: tuple[Earlier, ...] = ()


def gaze_input(chunk: GazeChunk, recall: Recall) -> GazeInput:
    """Return the chunk with what the monitor recorded under its number."""
    found = recall("gaze", source=chunk.source, seq=chunk.seq)
    return GazeInput(chunk, tuple(earlier_of(fact) for fact in found if isinstance(fact, Gaze)))


def earlier_of(fact: Gaze) -> Earlier:
    """Return what a later chunk of the same number is compared with."""
    accepted = len(fact.t) if fact.outcome == "applied" else 0
    columns: dict[str, list[object]] = {name: getattr(fact, name) for name in COLUMNS}
    return Earlier(fact.segment, accepted, tuple(fact.warnings), (fact.t, columns))


def is_repeat(given: GazeInput) -> Earlier | None:
    """Return what was recorded of the very same chunk; none where there is nothing like it."""
    if not given.earlier:
        return None
    columns = {name: [] for name in COLUMNS} | recorded_columns(given.chunk)
    same = (e for e in given.earlier if e.columns is not None and e.columns == (given.chunk.t, columns))
    return next(same, None)
