"""Single gaze samples become chunks; what has no number gets one. Pure: the shell says when to take.

A lane is one gaze source of one session. Chunks that a source numbered itself pass as they are, in their
order; unnumbered ones are joined, since chunks of ten carry 3.5 times the samples (DESIGN.md).
"""

from __future__ import annotations

from collections import deque

from shift_schemas.errors import FieldError, MalformedMessage, shorten
from shift_schemas.messages import GazeChunk

from shift_ros2.mapping import COLUMNS, GazeArrival


class Lane:
    """What waits of one source."""

    def __init__(self, source: str) -> None:
        self.source = source
        self.samples = 0
        """Samples that wait."""
        self._waiting: deque[GazeArrival] = deque()
        self._last_t: float | None = None

    def __bool__(self) -> bool:
        return bool(self._waiting)

    def add(self, arrival: GazeArrival) -> None:
        """Take it in. Raises :class:`MalformedMessage` for a time that does not rise: it would spoil its chunk."""
        t = arrival.chunk.t
        if not arrival.numbered and self._last_t is not None and t[0] <= self._last_t:
            rule = f"t must rise; the sample before was at {self._last_t} s, {self.source}'s clock"
            raise MalformedMessage(f"gaze: t: {rule}", (FieldError(field="t", value=shorten(t[0]), rule=rule),))
        self._last_t = t[-1]
        self.samples += len(t)
        self._waiting.append(arrival)

    def ripe(self, samples: int) -> bool:
        """Whether there is no sense in waiting for more: it has its number, or there are so many samples."""
        return bool(self._waiting) and (self._waiting[0].numbered or self.samples >= samples)

    def take(self, limit: int) -> list[GazeArrival]:
        """What makes the next chunk: one that is numbered, or unnumbered ones of a kind, of ``limit`` samples."""
        taken = [self._waiting.popleft()]
        count = len(taken[0].chunk.t)
        while not taken[0].numbered and self._waiting and _alike(taken[0], self._waiting[0]):
            count += len(self._waiting[0].chunk.t)
            if count > limit:
                break
            taken.append(self._waiting.popleft())
        self.samples -= sum(len(a.chunk.t) for a in taken)
        return taken


def joined(arrivals: list[GazeArrival], seq: int) -> GazeChunk:
    """Unnumbered gaze of one kind as one chunk."""
    first = arrivals[0].chunk
    columns = {
        name: [value for a in arrivals for value in getattr(a.chunk, name)]
        for name in COLUMNS
        if getattr(first, name) is not None
    }
    return GazeChunk(source=first.source, seq=seq, **columns)


def _alike(a: GazeArrival, b: GazeArrival) -> bool:
    return not b.numbered and all((getattr(a.chunk, n) is None) == (getattr(b.chunk, n) is None) for n in COLUMNS)
