"""Chunks of a live source rise in time; what does not rise is left out or begins a chunk."""

from __future__ import annotations

from shift_schemas.messages import GazeChunk
from shift_sources.files.samples import Eyes, Sample, named_sample
from shift_sources.gaze_batching import GazeBuffer
from shift_sources.live.feed import PERSISTENT, Batch, Chunker


def samples(*times: float) -> list[Sample]:
    return [Sample(t, 0.5, 0.5, True) for t in times]


def chunks(chunker: Chunker, batch: Batch) -> list[GazeChunk]:
    return [arrival.chunk for arrival in chunker.arrivals(batch)]


def test_steps_of_the_clock_begin_chunks_and_samples_that_overtake_are_counted() -> None:
    chunker = Chunker("tx")
    found = [c.t for c in chunks(chunker, Batch(samples(1.0, 1.1, 1.05, 1.2, 11.2, 11.3, 1.3, 1.4)))]
    assert found == [[1.0, 1.1, 1.2], [11.2, 11.3], [1.3, 1.4]]
    assert chunker.out_of_order == 1
    assert [c.t for c in chunks(chunker, Batch(samples(1.4, 1.5)))] == [[1.5]]
    assert chunker.out_of_order == 2


def test_small_step_back_that_lasts_begins_a_chunk_and_loses_nothing() -> None:
    chunker, buffer = Chunker("tx"), GazeBuffer()
    before = [10 + i / 100 for i in range(50)]
    after = [time - 0.2 for time in (10.5 + i / 100 for i in range(50))]
    arrivals = [a for batch in (before + after[:4], after[4:]) for a in chunker.arrivals(Batch(samples(*batch)))]
    assert [t for a in arrivals for t in a.chunk.t] == before + after
    assert [a.anew for a in arrivals] == [False, True]
    assert chunker.out_of_order == 0
    for arrival in arrivals:
        buffer.add(arrival)
    assert [a.chunk.t[0] for a in buffer.take(500)] == [10.0], "the two are sent as two chunks"


def test_samples_that_overtake_for_long_do_not_begin_a_chunk() -> None:
    chunker = Chunker("tx")
    pairs = [t for i in range(4 * PERSISTENT) for t in (1 + i / 100, 1 + i / 100 - 0.005)]
    (found,) = chunks(chunker, Batch(samples(*pairs)))
    assert found.t == [1 + i / 100 for i in range(4 * PERSISTENT)]
    assert chunker.out_of_order == 4 * PERSISTENT


def test_chunk_has_what_the_source_measured_and_the_columns_of_its_samples() -> None:
    eyes = Eyes(pupil_left=3.0)
    (points,) = chunks(Chunker("tx"), Batch([Sample(0.0, 0.1, 0.2, True, eyes)], round_trip_s=0.01, offset_s=2.0))
    assert (points.source, points.x, points.pupil_left, points.pupil_right) == ("tx", [0.1], [3.0], None)
    assert (points.round_trip_s, points.offset_s) == (0.01, 2.0)
    (names,) = chunks(Chunker("tx"), Batch([named_sample(0.0, "cup"), named_sample(0.1, None)], named=True))
    assert (names.aoi, names.x) == (["cup", None], None)
