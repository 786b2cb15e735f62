"""Single gaze samples become chunks, and chunks without a number get one. Pure: the caller decides when to take.

A buffer holds the gaze of one session in its order of arrival. A source that begins to send replaces the one before,
so the gaze of the former source must be sent first. Chunks that a source numbered itself pass unchanged. Chunks
without a number are joined: chunks of ten carry 3.5 times as many samples a second (docs/design.md).
"""

from __future__ import annotations

from collections import OrderedDict, deque
from typing import Any, NamedTuple

from shift_schemas.errors import FieldError, MalformedMessage, shorten
from shift_schemas.messages import GazeChunk
from shift_schemas.messages.monitor import EYE_COLUMNS

COLUMNS = ("t", "x", "y", "valid", "aoi", *EYE_COLUMNS)
"""The fields of a chunk that hold one value for each sample."""
RESTART_S = 1.0
"""Chosen: samples that overtake each other differ by less."""
MOST_SOURCES = 256
"""How many sources are remembered. The monitor still compares the times of an older source; this module does not."""


class GazeArrival(NamedTuple):
    """Gaze as it arrived. If it came without ``seq``, the chunk's is 0 and the forwarder numbers it."""

    session: str | None
    chunk: GazeChunk
    numbered: bool
    anew: bool = False
    """Whether the source is known to have set its clock back before it."""


class GazeBuffer:
    """The gaze of one session that waits to be sent."""

    def __init__(self) -> None:
        self.samples = 0
        """How many samples wait."""
        self._waiting: deque[GazeArrival] = deque()
        self._last_t: OrderedDict[str, float] = OrderedDict()

    def __bool__(self) -> bool:
        return bool(self._waiting)

    def add(self, arrival: GazeArrival) -> None:
        """Add an arrival.

        A time that goes back by :data:`RESTART_S` or more is a clock that began anew: the arrival begins a chunk, and
        the monitor begins a segment. A smaller step back raises :class:`MalformedMessage`: it would spoil its chunk.
        """
        t, source = arrival.chunk.t, arrival.chunk.source
        last = self._last_t.get(source)
        if not (arrival.numbered or arrival.anew) and last is not None and last - RESTART_S < t[0] <= last:
            rule = f"t must rise; the sample before was at {last} s, {source}'s clock"
            raise MalformedMessage(f"gaze: t: {rule}", (FieldError(field="t", value=shorten(t[0]), rule=rule),))
        self._last_t[source] = t[-1]
        self._last_t.move_to_end(source)
        if len(self._last_t) > MOST_SOURCES:
            self._last_t.popitem(last=False)
        self.samples += len(t)
        self._waiting.append(arrival)

    def drop_oldest(self, most: int) -> list[GazeArrival]:
        """Remove the oldest arrivals until ``most`` samples wait, and return them."""
        dropped = []
        while self._waiting and self.samples > most:
            dropped.append(self._waiting.popleft())
            self.samples -= len(dropped[-1].chunk.t)
        return dropped

    def is_ready(self, samples: int) -> bool:
        """Return whether to send now: the first arrival has a number, or ``samples`` samples wait."""
        return bool(self._waiting) and (self._waiting[0].numbered or self.samples >= samples)

    def take(self, limit: int) -> list[GazeArrival]:
        """Remove and return the arrivals of the next chunk.

        That is one arrival with a number, or arrivals of one kind without a number, of ``limit`` samples at most.
        """
        taken = [self._waiting.popleft()]
        count = len(taken[0].chunk.t)
        while not taken[0].numbered and self._waiting and _can_join(taken[-1], self._waiting[0]):
            count += len(self._waiting[0].chunk.t)
            if count > limit:
                break
            taken.append(self._waiting.popleft())
        self.samples -= sum(len(a.chunk.t) for a in taken)
        return taken


def join(arrivals: list[GazeArrival], seq: int) -> GazeChunk:
    """Return arrivals of one kind as one chunk with the number ``seq``."""
    first = arrivals[0].chunk
    columns: dict[str, Any] = {
        name: [value for a in arrivals for value in getattr(a.chunk, name)]
        for name in COLUMNS
        if getattr(first, name) is not None
    }
    for name in ("round_trip_s", "offset_s"):
        measured = [value for a in arrivals if (value := getattr(a.chunk, name)) is not None]
        columns[name] = measured[-1] if measured else None
    return GazeChunk(source=first.source, seq=seq, **columns)


def _can_join(a: GazeArrival, b: GazeArrival) -> bool:
    same = a.chunk.source == b.chunk.source and not b.numbered and 0 < b.chunk.t[0] - a.chunk.t[-1] <= RESTART_S
    return same and all((getattr(a.chunk, n) is None) == (getattr(b.chunk, n) is None) for n in COLUMNS)
