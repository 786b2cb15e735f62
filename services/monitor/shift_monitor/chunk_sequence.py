"""Chunk numbers of one segment of a gaze source: what is new, late or a restart, and what never came. Pure.

A segment is what a source sent between two restarts of its clock or its numbering.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

OVERTAKEN = 64
"""Chosen: so many chunks may arrive after the one that began the segment and still be late; before that, a restart."""

Arrival = Literal["new", "late", "restart"]


@dataclass(frozen=True, slots=True)
class Numbering:
    """How far a segment has been read."""

    last: int = -1
    first: int = 0
    """The number that the segment began with."""


def arrival(numbering: Numbering, seq: int, used: bool, goes_on: bool) -> Arrival:
    """Return what a chunk with this number is; the caller has seen that it is no repeat.

    Parameters
    ----------
    used
        Whether another chunk of the segment had this number.
    goes_on
        Whether the chunk is later, on the source's clock, than all that was read of the segment.
    """
    if seq > numbering.last:
        return "new" if goes_on else "restart"
    if used or goes_on or seq < numbering.first - OVERTAKEN:
        return "restart"
    return "late"


def skipped(numbering: Numbering, seq: int) -> int:
    """Return how many chunks are missing before a new one."""
    return seq - numbering.last - 1


def read(numbering: Numbering, seq: int) -> Numbering:
    """Return the numbering after a new chunk."""
    return Numbering(seq, seq if numbering.last < 0 else numbering.first)


def began_anew(seq: int) -> Numbering:
    """Return the numbering of a segment that begins with this number: nothing before it counts as missing."""
    return Numbering(seq - 1, seq)
