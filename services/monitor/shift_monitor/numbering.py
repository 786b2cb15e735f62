"""Chunk numbers of one gaze source: what is new, a repeat, late, and what never came. Pure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

LONGEST_LIST = 64
"""Chosen: how many gaps are remembered; a late chunk of an older gap is taken for a repeat."""

Arrival = Literal["new", "repeat", "late"]


@dataclass(frozen=True, slots=True)
class Numbering:
    """How far a source has been read, and the gaps before that, (first, last) each, oldest first."""

    last: int = -1
    gaps: tuple[tuple[int, int], ...] = ()


def arrival(numbering: Numbering, seq: int) -> Arrival:
    """What a chunk with this number is."""
    if seq > numbering.last:
        return "new"
    return "late" if any(first <= seq <= last for first, last in numbering.gaps) else "repeat"


def skipped(numbering: Numbering, seq: int) -> int:
    """How many chunks are missing before a new one."""
    return seq - numbering.last - 1


def read(numbering: Numbering, seq: int) -> Numbering:
    """The numbering after a new chunk."""
    gap = ((numbering.last + 1, seq - 1),) if skipped(numbering, seq) else ()
    return Numbering(seq, (*numbering.gaps, *gap)[-LONGEST_LIST:])


def came_late(numbering: Numbering, seq: int) -> Numbering:
    """The numbering after a late chunk: should it come again, it is a repeat."""
    gaps: list[tuple[int, int]] = []
    for first, last in numbering.gaps:
        if first <= seq <= last:
            parts = ((first, seq - 1), (seq + 1, last))
            gaps.extend(part for part in parts if part[0] <= part[1])
        else:
            gaps.append((first, last))
    return Numbering(numbering.last, tuple(gaps[-LONGEST_LIST:]))
