"""What a live source gives: samples, markers, and what it measured of its clock. Pure but for :class:`Feed`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Protocol

from shift_sources.files.samples import Sample, chunk_of
from shift_sources.gaze_batching import RESTART_S, GazeArrival


@dataclass(frozen=True)
class Batch:
    """What came since the last reading."""

    samples: list[Sample] = field(default_factory=list)
    """In the order of their arrival, with the time of the source's clock, s."""
    markers: list[str] = field(default_factory=list)
    named: bool = False
    """Whether the samples are AOI names and not points."""
    round_trip_s: float | None = None
    offset_s: float | None = None
    """This computer's clock minus the source's clock, as the source's protocol measured it, s."""


class Feed(Protocol):
    """A connection to a source. Its methods are called from one thread at a time."""

    def read(self) -> Batch:
        """Return what came, after a short wait at most. It reconnects by itself."""

    def close(self) -> None:
        """End the connection."""

    @property
    def about(self) -> str:
        """What it is connected to, in a few words."""

    @property
    def reconnects(self) -> int:
        """How often the connection was made again."""


PERSISTENT = 10
"""Chosen: so many samples in a row that are behind are no samples that overtook each other: the clock was set back."""


class Chunker:
    """Makes chunks of the samples of one source. Their time rises in each chunk.

    A step of :data:`RESTART_S` or more in either direction begins a chunk, since the clock may have been set. A sample
    whose time goes back by less is left out and counted, because two samples overtook each other or one came twice; but
    :data:`PERSISTENT` of them in a row are a clock that was set back, and begin a chunk as well.
    """

    def __init__(self, source: str) -> None:
        self._source = source
        self._last: float | None = None
        self._behind: list[Sample] = []
        self._left_out = 0

    @property
    def out_of_order(self) -> int:
        """Samples that were left out so far."""
        return self._left_out + len(self._behind)

    def arrivals(self, batch: Batch) -> Iterator[GazeArrival]:
        """Yield the chunks of a batch, without numbers."""
        for anew, part in self._rising(batch.samples):
            chunk = chunk_of(part, self._source, 0, batch.named)
            chunk = chunk.model_copy(update={"round_trip_s": batch.round_trip_s, "offset_s": batch.offset_s})
            yield GazeArrival(None, chunk, numbered=False, anew=anew)

    def _rising(self, samples: Iterable[Sample]) -> Iterator[tuple[bool, list[Sample]]]:
        """Yield samples whose time rises, and whether the clock was set back before them."""
        part: list[Sample] = []
        anew = False
        for sample in samples:
            last = self._last
            if last is not None and last - RESTART_S < sample.t <= last:
                if not self._is_set_back(sample):
                    continue
                found, self._behind = self._behind, []
                if part:
                    yield anew, part
                part, anew, self._last = found, True, sample.t
                continue
            if part and last is not None and not 0 < sample.t - last <= RESTART_S:
                yield anew, part
                part, anew = [], False
            self._forget_behind()
            part.append(sample)
            self._last = sample.t
        if part:
            yield anew, part

    def _is_set_back(self, sample: Sample) -> bool:
        """Note a sample that is behind; return whether there were enough in a row, each later than the one before."""
        if self._behind and sample.t <= self._behind[-1].t:
            self._forget_behind()
        self._behind.append(sample)
        return len(self._behind) >= PERSISTENT

    def _forget_behind(self) -> None:
        self._left_out += len(self._behind)
        self._behind = []
