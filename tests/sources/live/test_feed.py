"""Chunks of a live source rise in time; what does not rise is left out or begins a chunk."""

from __future__ import annotations

from shift_sources.files.samples import Eyes, Sample, named_sample
from shift_sources.live.feed import Batch, Chunker


def samples(*times: float) -> list[Sample]:
    return [Sample(t, 0.5, 0.5, True) for t in times]


def test_steps_of_the_clock_begin_chunks_and_samples_that_overtake_are_counted() -> None:
    chunker = Chunker("tx")
    found = [c.t for c in chunker.chunks(Batch(samples(1.0, 1.1, 1.05, 1.2, 11.2, 11.3, 1.3, 1.4)))]
    assert found == [[1.0, 1.1, 1.2], [11.2, 11.3], [1.3, 1.4]]
    assert chunker.out_of_order == 1
    assert [c.t for c in chunker.chunks(Batch(samples(1.4, 1.5)))] == [[1.5]]
    assert chunker.out_of_order == 2


def test_chunk_has_what_the_source_measured_and_the_columns_of_its_samples() -> None:
    eyes = Eyes(pupil_left=3.0)
    (points,) = Chunker("tx").chunks(Batch([Sample(0.0, 0.1, 0.2, True, eyes)], round_trip_s=0.01, offset_s=2.0))
    assert (points.source, points.x, points.pupil_left, points.pupil_right) == ("tx", [0.1], [3.0], None)
    assert (points.round_trip_s, points.offset_s) == (0.01, 2.0)
    (names,) = Chunker("tx").chunks(Batch([named_sample(0.0, "cup"), named_sample(0.1, None)], named=True))
    assert (names.aoi, names.x) == (["cup", None], None)
