"""Gaze samples as every reader returns them, and chunks of them. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import islice
from typing import NamedTuple

from shift_schemas.messages import GazeChunk


class Sample(NamedTuple):
    """One gaze sample.

    ``t`` is in seconds since the first sample of the file, on the tracker's clock. ``x`` and ``y`` are 0..1 from the
    upper left corner of the stimulus, and None if the sample is lost.
    """

    t: float
    x: float | None
    y: float | None
    valid: bool


def sample_of_eyes(t: float, points: Sequence[tuple[float, float]]) -> Sample:
    """Return the mean of the points of the valid eyes; without a valid eye, the sample is lost."""
    if not points:
        return Sample(t, None, None, False)
    return Sample(t, sum(x for x, _ in points) / len(points), sum(y for _, y in points) / len(points), True)


def chunks(samples: Iterable[Sample], n: int, source: str = "file") -> Iterator[GazeChunk]:
    """Yield the samples as chunks of ``n``, numbered from 0; the last chunk may be shorter."""
    rest = iter(samples)
    seq = 0
    while part := list(islice(rest, n)):
        yield GazeChunk(
            source=source,
            seq=seq,
            t=[s.t for s in part],
            x=[s.x for s in part],
            y=[s.y for s in part],
            valid=[s.valid for s in part],
        )
        seq += 1
