"""What is said of gaze that is accepted: shares of the source's time, age, and warnings."""

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


def test_shares_are_those_of_a_naive_sum_over_the_samples() -> None:
    """One second lost, one on no AOI, one on the cup, at 100 Hz."""
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


def test_points_beside_the_stimulus_are_off_it_and_those_beyond_are_refused_with_the_units() -> None:
    view = last(fold(began(), at_rate(100, 101, x=-0.2))[1]).gaze
    assert view.off_stimulus == 1.0
    for x in (-1.0, 2.0):
        fold(began(), at_rate(100, 3, x=x))
    for x in (-1.001, 2.001, 10.0, 192.0, -9999.0):
        with pytest.raises(MalformedMessage, match="divide pixels by the stimulus' width"):
            step(began(), at_rate(100, 3, x=x), NOW)


def test_what_an_invalid_sample_says_is_not_looked_at() -> None:
    chunk = GazeChunk(source="eyes", seq=0, t=[0.0, 0.01], x=[-9999.0, 0.1], y=[-9999.0, 0.5], valid=[False, True])
    gaze = fold(began(), chunk)[1][0]
    assert isinstance(gaze, Gaze)
    assert gaze.valid == [False, True]


def test_the_age_of_the_last_sample_is_told_with_each_observation() -> None:
    assert last(fold(began(), names(0, [0.0], ["left"]))[1]).gaze.age_s == 0.0
    state, _ = fold(began(), names(0, [0.0], ["left"]))
    later = step(state, performance(1, True, True), Stamp.of(NOW.ns + 7 * NS // 2)).facts[-1]
    assert isinstance(later, Observation)
    assert later.gaze.received == NOW
    assert later.gaze.age_s == 3.5


@pytest.mark.parametrize("hz", [5, 4, 2, 1])
def test_points_too_far_apart_for_a_fixation_are_told_of(hz: float) -> None:
    (warning,) = [w for w in warnings(at_rate(hz, 12)) if "can never make a fixation" in w]
    assert "at most 0.15 s apart" in warning


@pytest.mark.parametrize("hz", [2000, 1200, 300, 60, 30, 15, 10, 7])
def test_nothing_is_said_of_steady_gaze_at_the_rates_of_trackers(hz: float) -> None:
    assert warnings(at_rate(hz, max(12, int(hz)))) == []


@pytest.mark.parametrize("factor", [1e3, 1e6])
def test_milliseconds_and_microseconds_in_place_of_seconds_are_told_of(factor: float) -> None:
    chunk = points(0, [(100 + i * 0.01) * factor for i in range(8)], [0.1] * 8)
    assert any("t must be in seconds" in w for w in warnings(chunk))


def test_a_rate_is_told_of_whatever_the_cut_of_chunks() -> None:
    chunks = [at_rate(4, 1, seq=i, start_s=i / 4) for i in range(12)]
    assert any("can never make a fixation" in w for w in warnings(*chunks))


def test_one_gap_in_good_gaze_is_not_told_of() -> None:
    t = [i / 100 for i in range(50)] + [1.5 + i / 100 for i in range(50)]
    assert [w for w in warnings(points(0, t, [0.1] * 100)) if "apart" in w or "Hz" in w] == []


def test_gaze_that_is_mostly_lost_or_off_the_stimulus_is_told_of() -> None:
    assert any("100% of the source's time is lost" in w for w in warnings(at_rate(100, 100, x=None)))
    assert any("100% of the source's time is off the stimulus" in w for w in warnings(at_rate(100, 100, x=-1.0)))
    half = points(0, [i / 100 for i in range(200)], [0.1] * 101 + [None] * 99)
    assert warnings(half) == []


def test_warnings_stand_in_the_recorded_chunk_and_in_the_answer() -> None:
    done = step(began(), at_rate(2, 12), NOW)
    gaze = done.facts[0]
    assert isinstance(gaze, Gaze)
    assert isinstance(done.result, dict)
    assert gaze.warnings == done.result["warnings"] == last(list(done.facts)).warnings
    assert len(gaze.warnings) >= 1
