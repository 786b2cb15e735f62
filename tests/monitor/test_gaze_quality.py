"""Quality of accepted gaze: shares of the source's time, age of the last sample, and warnings."""

from __future__ import annotations

import pytest
from shift_monitor.core import step
from shift_schemas.errors import MalformedMessage
from shift_schemas.messages import Gaze, GazeChunk, Observation
from shift_schemas.timestamps import NS, Stamp
from support.monitor_sessions import NOW, began, fold, last, names, performance, points, study


def at_rate(hz: float, n: int, x: float | None = 0.1, seq: int = 0, start_s: float = 10.0) -> GazeChunk:
    return points(seq, [round(start_s + i / hz, 6) for i in range(n)], [x] * n)


def warnings(*chunks: GazeChunk) -> list[str]:
    return last(fold(began(), *chunks)[1]).warnings


def test_shares_match_a_sum_over_the_samples() -> None:
    """One second is lost, one is on no AOI and one is on the cup, at 100 Hz."""
    cup = study(aois=[{"name": "cup", "rectangle": [0.0, 0.0, 0.5, 1.0]}])
    x = [None] * 100 + [0.9] * 100 + [0.2] * 101
    t = [i / 100 for i in range(301)]
    view = last(fold(began(cup), points(0, t, x))[1]).gaze
    assert view.lost == pytest.approx(1 / 3, abs=1e-9)
    assert view.off_aoi is not None
    assert view.unclassified is not None
    assert view.dwell_s is not None
    assert view.off_aoi == pytest.approx(1 / 3, abs=0.02)
    assert view.off_aoi + view.unclassified + view.dwell_s / 3 == pytest.approx(2 / 3, abs=1e-9)
    assert view.off_stimulus == 0.0
    assert view.samples == 301


def test_names_stand_until_the_next_one_and_at_most_for_a_second() -> None:
    view = last(fold(began(), names(0, [0.0, 1.0, 2.0, 5.0], ["left", None, "right", "right"]))[1]).gaze
    assert (view.lost, view.off_aoi, view.unclassified, view.dwell_s) == (2 / 5, 1 / 5, 0.0, 2.0)


def test_points_beside_the_stimulus_are_counted_and_impossible_ones_are_refused() -> None:
    view = last(fold(began(), at_rate(100, 101, x=-0.2))[1]).gaze
    assert view.off_stimulus == 1.0
    for x in (-1.0, 2.0):
        fold(began(), at_rate(100, 3, x=x))
    for x in (-1.001, 2.001, 10.0, 192.0, -9999.0):
        with pytest.raises(MalformedMessage, match="divide pixels by the stimulus' width"):
            step(began(), at_rate(100, 3, x=x), NOW)


def test_coordinates_of_an_invalid_sample_are_ignored() -> None:
    chunk = GazeChunk(source="eyes", seq=0, t=[0.0, 0.01], x=[-9999.0, 0.1], y=[-9999.0, 0.5], valid=[False, True])
    gaze = fold(began(), chunk)[1][0]
    assert isinstance(gaze, Gaze)
    assert gaze.valid == [False, True]


def test_each_observation_has_the_age_of_the_last_sample() -> None:
    assert last(fold(began(), names(0, [0.0], ["left"]))[1]).gaze.age_s == 0.0
    state, _ = fold(began(), names(0, [0.0], ["left"]))
    later = step(state, performance(1, True, True), Stamp.of(NOW.ns + 7 * NS // 2)).facts[-1]
    assert isinstance(later, Observation)
    assert later.gaze.received == NOW
    assert later.gaze.age_s == 3.5


@pytest.mark.parametrize("hz", [5, 4, 2, 1])
def test_points_too_far_apart_for_a_fixation_cause_a_warning(hz: float) -> None:
    (warning,) = [w for w in warnings(at_rate(hz, 12)) if "can never make a fixation" in w]
    assert "at most 0.15 s apart" in warning


@pytest.mark.parametrize("hz", [2000, 1200, 300, 60, 30, 15, 10, 7])
def test_steady_gaze_at_the_rates_of_trackers_causes_no_warning(hz: float) -> None:
    assert warnings(at_rate(hz, max(12, int(hz)))) == []


@pytest.mark.parametrize("factor", [1e3, 1e6])
def test_milliseconds_and_microseconds_instead_of_seconds_cause_a_warning(factor: float) -> None:
    chunk = points(0, [(100 + i * 0.01) * factor for i in range(8)], [0.1] * 8)
    assert any("t must be in seconds" in w for w in warnings(chunk))


def test_warning_about_the_rate_does_not_depend_on_the_cut_of_chunks() -> None:
    chunks = [at_rate(4, 1, seq=i, start_s=i / 4) for i in range(12)]
    assert any("can never make a fixation" in w for w in warnings(*chunks))


def test_one_gap_in_good_gaze_causes_no_warning() -> None:
    t = [i / 100 for i in range(50)] + [1.5 + i / 100 for i in range(50)]
    assert [w for w in warnings(points(0, t, [0.1] * 100)) if "apart" in w or "Hz" in w] == []


def test_gaze_mostly_lost_or_off_the_stimulus_causes_a_warning() -> None:
    assert any("100% of the source's time is lost" in w for w in warnings(at_rate(100, 100, x=None)))
    assert any("100% of the source's time is off the stimulus" in w for w in warnings(at_rate(100, 100, x=-1.0)))
    half = points(0, [i / 100 for i in range(200)], [0.1] * 101 + [None] * 99)
    assert warnings(half) == []


def test_recorded_chunk_and_reply_contain_the_warnings() -> None:
    done = step(began(), at_rate(2, 12), NOW)
    gaze = done.facts[0]
    assert isinstance(gaze, Gaze)
    assert isinstance(done.result, dict)
    assert gaze.warnings == done.result["warnings"] == last(list(done.facts)).warnings
    assert len(gaze.warnings) >= 1
