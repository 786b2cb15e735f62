"""What a live source gives: samples, markers, and what it measured of its clock. Pure but for :class:`Feed`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Protocol

from shift_schemas.messages import GazeChunk

from shift_sources.files.samples import Sample, chunk_of
from shift_sources.gaze_batching import RESTART_S


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


class Chunker:
    """Makes chunks of the samples of one source. Their time rises in each chunk.

    A sample whose time goes back by less than :data:`RESTART_S` is left out and counted: two samples overtook each
    other, or a sample came twice. A larger step in either direction begins a chunk, since the clock may have been set.
    """

    def __init__(self, source: str) -> None:
        self._source = source
        self._last: float | None = None
        self.out_of_order = 0
        """Samples that were left out."""

    def chunks(self, batch: Batch) -> Iterator[GazeChunk]:
        """Yield the chunks of a batch; their number is 0."""
        for part in self._rising(batch.samples):
            chunk = chunk_of(part, self._source, 0, batch.named)
            yield chunk.model_copy(update={"round_trip_s": batch.round_trip_s, "offset_s": batch.offset_s})

    def _rising(self, samples: Iterable[Sample]) -> Iterator[list[Sample]]:
        part: list[Sample] = []
        for sample in samples:
            last = self._last
            if last is not None and last - RESTART_S < sample.t <= last:
                self.out_of_order += 1
                continue
            if part and last is not None and not 0 < sample.t - last <= RESTART_S:
                yield part
                part = []
            part.append(sample)
            self._last = sample.t
        if part:
            yield part
