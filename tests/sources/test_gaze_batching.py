"""Batching of single gaze samples."""

from __future__ import annotations

import pytest
from shift_schemas.errors import MalformedMessage
from shift_schemas.messages import GazeChunk
from shift_sources.gaze_batching import GazeArrival, GazeBuffer, join


def sample(t: float, source: str = "ros", seq: int | None = None) -> GazeArrival:
    return GazeArrival(None, GazeChunk(source=source, seq=seq or 0, t=[t], aoi=["a"]), seq is not None)


def test_samples_are_joined_in_their_order_up_to_the_limit() -> None:
    buffer = GazeBuffer()
    for i in range(25):
        buffer.add(sample(float(i)))
    assert buffer.is_ready(10)
    sizes, times = [], []
    while buffer:
        taken = buffer.take(10)
        chunk = join(taken, len(sizes))
        sizes.append(len(chunk.t))
        times += chunk.t
    assert sizes == [10, 10, 5]
    assert times == [float(i) for i in range(25)]
    assert buffer.samples == 0


def test_different_arrivals_are_not_joined() -> None:
    buffer = GazeBuffer()
    point = GazeArrival(None, GazeChunk(source="ros", seq=0, t=[2.0], x=[0.5], y=[0.5]), False)
    for arrival in (sample(1.0), point, sample(3.0), sample(1.0, "other"), sample(2.0, "other", seq=5)):
        buffer.add(arrival)
    assert [len(buffer.take(10)) for _ in range(5)] == [1, 1, 1, 1, 1]


def test_time_that_does_not_rise_costs_only_that_sample() -> None:
    buffer = GazeBuffer()
    buffer.add(sample(1.0))
    with pytest.raises(MalformedMessage, match="t must rise"):
        buffer.add(sample(1.0))
    buffer.add(sample(1.5))
    buffer.add(sample(0.5, "another clock"[:7]))
    assert buffer.samples == 3
