"""A chunk of gaze together with what was recorded under its number: this tells a repeat from a restart. Pure.

The same content under the same number of a source is a repeat, however long ago it was first sent.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

from shift_schemas.messages import Fact, Gaze, GazeChunk
from shift_schemas.messages.monitor import EYE_COLUMNS

from shift_monitor.gaze_columns import recorded_columns

Recall = Callable[..., Iterable[Fact]]
"""``recall(subject, **fields)`` returns the session's own facts of a subject whose fields have these values."""

COLUMNS: dict[str, Any] = {"x": [], "y": [], "valid": [], "aoi": []} | dict.fromkeys(EYE_COLUMNS)
"""The columns that are compared, with their values where a chunk does not have them."""


class RecordedChunk(NamedTuple):
    """The record of one number of a source. Without ``columns`` its content is known to be different."""

    segment: int
    accepted: int = 0
    warnings: tuple[str, ...] = ()
    columns: tuple[list[float], dict[str, Any]] | None = None
    """The times, and the other columns by name."""


class ChunkWithHistory(NamedTuple):
    """A chunk, and the records of its source and number, oldest first."""

    chunk: GazeChunk
    earlier: tuple[RecordedChunk, ...] = ()


def gaze_input(chunk: GazeChunk, recall: Recall) -> ChunkWithHistory:
    """Return the chunk with everything that the monitor recorded under its number."""
    found = recall("gaze", source=chunk.source, seq=chunk.seq)
    return ChunkWithHistory(chunk, tuple(earlier_of(fact) for fact in found if isinstance(fact, Gaze)))


def earlier_of(fact: Gaze) -> RecordedChunk:
    """Return the record that a later chunk of the same number is compared with."""
    accepted = len(fact.t) if fact.outcome == "applied" else 0
    columns: dict[str, Any] = {name: getattr(fact, name) for name in COLUMNS}
    return RecordedChunk(fact.segment, accepted, tuple(fact.warnings), (fact.t, columns))


def find_repeated(gaze: ChunkWithHistory) -> RecordedChunk | None:
    """Return the record of the very same chunk, or None if there is none."""
    if not gaze.earlier:
        return None
    columns = COLUMNS | recorded_columns(gaze.chunk)
    same = (e for e in gaze.earlier if e.columns is not None and e.columns == (gaze.chunk.t, columns))
    return next(same, None)
