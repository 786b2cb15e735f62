"""Single gaze samples become chunks; what has no number gets one. Pure: the shell says when to take.

A lane is the gaze of one session, in its order of arrival: a source that begins to speak takes over, so what the
former one said must be in before. Chunks that a source numbered itself pass as they are; unnumbered ones are
joined, since chunks of ten carry 3.5 times the samples (DESIGN.md).
"""

from __future__ import annotations

from collections import OrderedDict, deque

from shift_schemas.errors import FieldError, MalformedMessage, shorten
from shift_schemas.messages import GazeChunk

from shift_ros2.mapping import COLUMNS, GazeArrival

SOURCES = 256
"""So many sources are remembered; of an older one the times are no longer compared here, only by the monitor."""


class Lane:
    """What waits of one session."""

    def __init__(self) -> None:
        self.samples = 0
        """Samples that wait."""
        self._waiting: deque[GazeArrival] = deque()
        self._last_t: OrderedDict[str, float] = OrderedDict()

    def __bool__(self) -> bool:
        return bool(self._waiting)

    def add(self, arrival: GazeArrival) -> None:
        """Take it in. Raises :class:`MalformedMessage` for a time that does not rise: it would spoil its chunk."""
        t, source = arrival.chunk.t, arrival.chunk.source
        last = self._last_t.get(source)
        if not arrival.numbered and last is not None and t[0] <= last:
            rule = f"t must rise; the sample before was at {last} s, {source}'s clock"
            raise MalformedMessage(f"gaze: t: {rule}", (FieldError(field="t", value=shorten(t[0]), rule=rule),))
        self._last_t[source] = t[-1]
        self._last_t.move_to_end(source)
        if len(self._last_t) > SOURCES:
            self._last_t.popitem(last=False)
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
    same = a.chunk.source == b.chunk.source and not b.numbered
    return same and all((getattr(a.chunk, n) is None) == (getattr(b.chunk, n) is None) for n in COLUMNS)
