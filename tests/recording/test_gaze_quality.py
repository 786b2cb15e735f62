"""The quality of recorded gaze: the figures are the ones that were put in."""

from __future__ import annotations

import pytest
from shift_recording.gaze_quality import SourceQuality, quality_of
from shift_schemas.messages import Gaze
from shift_schemas.timestamps import Stamp

START = 1_700_000_000_000_000_000


def chunk(n: int, rate: float = 100.0, drift: float = 1.0, **changed: object) -> Gaze:
    """Return the ``n``-th chunk of ten samples, whose source's clock runs ``drift`` times as fast as the mesh's."""
    t = [(10 * n + i) / rate for i in range(10)]
    fields: dict[str, object] = {
        "session": "s1", "stamp": Stamp.of(START + round(1e9 * t[-1] / drift)), "source": "eyes", "seq": n, "t": t,
        "x": [0.5] * 10, "y": [0.5] * 10, "valid": [True] * 10,
    }  # fmt: skip
    return Gaze.model_validate({**fields, **changed})


def one(*chunks: Gaze) -> SourceQuality:
    (found,) = quality_of(chunks)
    return found


def test_steady_gaze_has_its_rate_and_no_fault() -> None:
    found = one(*(chunk(n) for n in range(200)))
    assert (found.samples, found.segments, found.late_chunks, found.missing_chunks) == (2000, 1, 0, 0)
    assert found.rate_hz == pytest.approx(100)
    assert (found.lost, found.gaps, found.longest_gap_s) == (0, 0, 0)
    assert found.drift_ppm == pytest.approx(0, abs=1)
    assert found.delay_spread_s == pytest.approx(0, abs=1e-6)


def test_drift_of_the_clock_is_the_one_that_was_put_in() -> None:
    assert one(*(chunk(n, drift=1.0002) for n in range(300))).drift_ppm == pytest.approx(200, abs=1)


def test_short_gaze_has_no_drift() -> None:
    assert one(chunk(0), chunk(1)).drift_ppm is None


def test_lost_samples_and_missing_chunks_are_counted() -> None:
    half = [True, False] * 5
    found = one(chunk(0), chunk(1, valid=half), chunk(4))
    assert found.lost == pytest.approx(5 / 30)
    assert found.missing_chunks == 2
    assert (found.gaps, found.longest_gap_s) == (1, pytest.approx(0.21))


def test_restart_is_a_segment_and_no_gap() -> None:
    found = one(chunk(0), chunk(1), chunk(0, segment=1), chunk(1, segment=1))
    assert (found.segments, found.missing_chunks, found.gaps) == (2, 0, 0)


def test_late_chunk_is_counted_and_not_missing() -> None:
    found = one(chunk(0), chunk(2), chunk(1, outcome="late"))
    assert (found.late_chunks, found.missing_chunks) == (1, 0)


def test_gaze_on_aois_has_its_share_and_no_loss() -> None:
    names = ["robot"] * 7 + [""] * 3
    found = one(chunk(0, x=[], y=[], valid=[], aoi=names))
    assert (found.on_aoi, found.lost) == (0.7, None)


def test_sources_are_apart_and_nothing_has_none() -> None:
    assert [q.source for q in quality_of([chunk(0), chunk(0, source="spare")])] == ["eyes", "spare"]
    assert quality_of([]) == []
