"""Warnings about accepted gaze: implausible rates, loss, and gaze beside the stimulus."""

from __future__ import annotations

import pytest
from shift_monitor.core import step
from shift_schemas.messages import Gaze, GazeChunk
from support.monitor_sessions import NOW, configured_session, fold, last, points


def at_rate(hz: float, n: int, x: float | None = 0.1, seq: int = 0, start_s: float = 10.0) -> GazeChunk:
    return points(seq, [round(start_s + i / hz, 6) for i in range(n)], [x] * n)


def warnings(*chunks: GazeChunk) -> list[str]:
    return last(fold(configured_session(), *chunks)[1]).warnings


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
    done = step(configured_session(), at_rate(2, 12), NOW)
    gaze = done.facts[0]
    assert isinstance(gaze, Gaze)
    assert isinstance(done.result, dict)
    assert gaze.warnings == done.result["warnings"] == last(list(done.facts)).warnings
    assert len(gaze.warnings) >= 1
