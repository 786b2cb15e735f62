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


class Marker(NamedTuple):
    """A message that the tracker recorded, at ``t`` seconds since the first sample; before it, ``t`` is negative."""

    t: float
    text: str


class Gaze(NamedTuple):
    """A gaze file that was recognised."""

    items: Iterator[Sample | Marker]
    """In order of time."""
    named: bool = False
    """Whether the samples are AOI names and not points."""


def sample_of_eyes(t: float, points: Sequence[tuple[float, float]], eyes: Eyes = NO_EYES) -> Sample:
    """Return the mean of the points of the valid eyes; without a valid eye, the sample is lost."""
    if not points:
        return Sample(t, None, None, False, eyes)
    return Sample(t, sum(x for x, _ in points) / len(points), sum(y for _, y in points) / len(points), True, eyes)


def lost_sample(t: float, eyes: Eyes = NO_EYES) -> Sample:
    """Return a sample without gaze."""
    return Sample(t, None, None, False, eyes)


def named_sample(t: float, aoi: str | None, tracked: bool = True, eyes: Eyes = NO_EYES) -> Sample:
    """Return a sample of AOI names. ``tracked`` is false where the gaze was lost."""
    return Sample(t, None, None, tracked, eyes, aoi if tracked else None)


def since_first(events: Iterable[tuple[float, Sample | str]], ticks: float) -> Iterator[Sample | Marker]:
    """Yield samples and messages with the time since the first sample, in seconds.

    Parameters
    ----------
    events
        Samples, whose own time is not used, and texts of messages, each with the tracker's time.
    ticks
        Units of the tracker's time in a second.
    """
    first: float | None = None
    early: list[tuple[float, str]] = []
    for time, what in events:
        if first is None and isinstance(what, str):
            early.append((time, what))
            continue
        if first is None:
            first = time
            yield from (Marker((t - time) / ticks, text) for t, text in early)
        t = (time - first) / ticks
        yield Marker(t, what) if isinstance(what, str) else what._replace(t=t)


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
