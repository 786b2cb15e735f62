"""Chunk numbers of one segment of a gaze source: which chunk is new, late or a restart, and how many are missing. Pure.

A segment is everything that a source sends between two restarts of its clock or its numbering.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

OVERTAKEN = 64
"""Chosen: a chunk may arrive this many numbers after the one that began the segment and still count as late.

A number further below is a restart.
"""

Arrival = Literal["new", "late", "restart"]


@dataclass(frozen=True, slots=True)
class ChunkSequence:
    """The numbers that were read of one segment."""

    last: int = -1
    first: int = 0
    """The number that the segment began with."""


def classify_arrival(sequence: ChunkSequence, seq: int, used: bool, continues: bool) -> Arrival:
    """Return whether a chunk with this number is new, late or a restart; it is known not to be a repeat.

    Parameters
    ----------
    used
        Whether another chunk of the segment had this number.
    continues
        Whether the chunk is later, on the source's clock, than everything that was read of the segment.
    """
    if seq > sequence.last:
        return "new" if continues else "restart"
    if used or continues or seq < sequence.first - OVERTAKEN:
        return "restart"
    return "late"


def missing_chunks(sequence: ChunkSequence, seq: int) -> int:
    """Return how many chunks are missing before a new one."""
    return seq - sequence.last - 1


def advance(sequence: ChunkSequence, seq: int) -> ChunkSequence:
    """Return the sequence after a new chunk."""
    return ChunkSequence(seq, seq if sequence.last < 0 else sequence.first)


def sequence_from(seq: int) -> ChunkSequence:
    """Return the sequence of a segment that begins with this number: no chunk before it counts as missing."""
    return ChunkSequence(seq - 1, seq)
