"""Gaze samples as every reader returns them, and chunks of them. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import islice
from typing import Any, NamedTuple

from shift_schemas.messages import GazeChunk


class Eyes(NamedTuple):
    """What a tracker says of each eye beside the point of gaze, in its own unit; None where it says nothing."""

    pupil_left: float | None = None
    pupil_right: float | None = None
    openness_left: float | None = None
    openness_right: float | None = None


NO_EYES = Eyes()


class Sample(NamedTuple):
    """One gaze sample.

    ``t`` is in seconds since the first sample of the file, on the tracker's clock. ``x`` and ``y`` are 0..1 from the
    upper left corner of the stimulus, and None if the sample is lost. ``aoi`` is the AOI's name in a file that names
    AOIs; such a file has no points, and a lost sample has no AOI.
    """

    t: float
    x: float | None
    y: float | None
    valid: bool
    eyes: Eyes = NO_EYES
    aoi: str | None = None


def sample_of_eyes(t: float, points: Sequence[tuple[float, float]]) -> Sample:
    """Return the mean of the points of the valid eyes; without a valid eye, the sample is lost."""
    if not points:
        return Sample(t, None, None, False)
    return Sample(t, sum(x for x, _ in points) / len(points), sum(y for _, y in points) / len(points), True)


def chunks(samples: Iterable[Sample], n: int, source: str = "file", named: bool = False) -> Iterator[GazeChunk]:
    """Yield the samples as chunks of ``n``, numbered from 0; the last chunk may be shorter.

    ``named`` says that they are AOI names and not points.
    """
    rest = iter(samples)
    seq = 0
    while part := list(islice(rest, n)):
        yield chunk_of(part, source, seq, named)
        seq += 1


def chunk_of(samples: Sequence[Sample], source: str, seq: int, named: bool = False) -> GazeChunk:
    """Return the samples as one chunk. It has the columns of the eyes of which any sample says something."""
    eyes = {name: [getattr(s.eyes, name) for s in samples] for name in Eyes._fields}
    columns: dict[str, Any] = {name: column for name, column in eyes.items() if any(v is not None for v in column)}
    if named:
        columns["aoi"] = [s.aoi for s in samples]
    else:
        columns |= {"x": [s.x for s in samples], "y": [s.y for s in samples], "valid": [s.valid for s in samples]}
    return GazeChunk(source=source, seq=seq, t=[s.t for s in samples], **columns)
