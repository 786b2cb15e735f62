"""Quality of accepted gaze: shares of the source's time, and the age of the last sample."""

from __future__ import annotations

import pytest
from shift_monitor.core import step
from shift_schemas.errors import MalformedMessage
from shift_schemas.messages import Gaze, GazeChunk, Observation
from shift_schemas.timestamps import NS, Stamp
from support.monitor_sessions import NOW, configured_session, fold, last, names, performance, points, study


def at_rate(hz: float, n: int, x: float | None = 0.1, seq: int = 0, start_s: float = 10.0) -> GazeChunk:
    return points(seq, [round(start_s + i / hz, 6) for i in range(n)], [x] * n)


def test_shares_match_a_sum_over_the_samples() -> None:
    """One second is lost, one is on no AOI and one is on the cup, at 100 Hz."""
    cup = study(aois=[{"name": "cup", "rectangle": [0.0, 0.0, 0.5, 1.0]}])
    x = [None] * 100 + [0.9] * 100 + [0.2] * 101
    t = [i / 100 for i in range(301)]
    view = last(fold(configured_session(cup), points(0, t, x))[1]).gaze
    assert view.lost == pytest.approx(1 / 3, abs=1e-9)
    assert view.off_aoi is not None
    assert view.unclassified is not None
    assert view.dwell_s is not None
    assert view.off_aoi == pytest.approx(1 / 3, abs=0.02)
    assert view.off_aoi + view.unclassified + view.dwell_s / 3 == pytest.approx(2 / 3, abs=1e-9)
    assert view.off_stimulus == 0.0
    assert view.samples == 301


def test_names_stand_until_the_next_one_and_at_most_for_a_second() -> None:
    view = last(fold(configured_session(), names(0, [0.0, 1.0, 2.0, 5.0], ["left", None, "right", "right"]))[1]).gaze
    assert (view.lost, view.off_aoi, view.unclassified, view.dwell_s) == (2 / 5, 1 / 5, 0.0, 2.0)


def test_points_beside_the_stimulus_are_counted_and_impossible_ones_are_refused() -> None:
    view = last(fold(configured_session(), at_rate(100, 101, x=-0.2))[1]).gaze
    assert view.off_stimulus == 1.0
    for x in (-1.0, 2.0):
        fold(configured_session(), at_rate(100, 3, x=x))
    for x in (-1.001, 2.001, 10.0, 192.0, -9999.0):
        with pytest.raises(MalformedMessage, match="divide pixels by the stimulus' width"):
            step(configured_session(), at_rate(100, 3, x=x), NOW)


def test_coordinates_of_an_invalid_sample_are_ignored() -> None:
    chunk = GazeChunk(source="eyes", seq=0, t=[0.0, 0.01], x=[-9999.0, 0.1], y=[-9999.0, 0.5], valid=[False, True])
    gaze = fold(configured_session(), chunk)[1][0]
    assert isinstance(gaze, Gaze)
    assert gaze.valid == [False, True]


def test_each_observation_has_the_age_of_the_last_sample() -> None:
    assert last(fold(configured_session(), names(0, [0.0], ["left"]))[1]).gaze.age_s == 0.0
    state, _ = fold(configured_session(), names(0, [0.0], ["left"]))
    later = step(state, performance(1, True, True), Stamp.of(NOW.ns + 7 * NS // 2)).facts[-1]
    assert isinstance(later, Observation)
    assert later.gaze.received == NOW
    assert later.gaze.age_s == 3.5
