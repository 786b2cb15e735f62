"""Online fixation detection, compared with the plain algorithm over the whole recording at once."""

from __future__ import annotations

import math
import statistics
from itertools import pairwise
from pathlib import Path

import pytest
from shift_schemas.timestamps import NS
from shift_sources.files.samples import Sample
from shift_study.constants import FixationSettings
from support.monitor_sessions import (
    RECORDINGS,
    configured_session,
    fixations,
    fold,
    last,
    played,
    points,
    recording,
    session,
    study,
)

Plain = tuple[int, float, float, int]
SETTINGS = FixationSettings()
HZ = 300


def degrees(value: float, size_cm: float) -> float:
    return math.degrees(math.atan((value - 0.5) * size_cm / SETTINGS.distance_cm))


def segments(samples: list[Sample]) -> list[list[Plain]]:
    """Return valid samples with the time that each stands for, cut where no sample stands for longer than the gap."""
    gap_ns = round(SETTINGS.maximum_gap_s * NS)
    times = [round(s.t * NS) for s in samples]
    stands = [min(b - a, gap_ns) for a, b in pairwise(times)] + [0]
    found: list[list[Plain]] = [[]]
    for sample, t_ns, duration_ns in zip(samples, times, stands, strict=True):
        if not sample.valid or sample.x is None or sample.y is None:
            continue
        if found[-1] and t_ns - found[-1][-1][0] - found[-1][-1][3] > gap_ns:
            found.append([])
        found[-1].append((t_ns, sample.x, sample.y, duration_ns))
    return found


def smoothed(segment: list[Plain]) -> list[Plain]:
    half_ns = round(SETTINGS.median_filter_s / 2 * NS)
    return [
        (
            t,
            statistics.median(p[1] for p in segment if abs(p[0] - t) <= half_ns),
            statistics.median(p[2] for p in segment if abs(p[0] - t) <= half_ns),
            d,
        )
        for t, _, _, d in segment
    ]


def small(window: list[Plain]) -> bool:
    xs = [degrees(p[1], SETTINGS.screen_width_cm) for p in window]
    ys = [degrees(p[2], SETTINGS.screen_height_cm) for p in window]
    return max(xs) - min(xs) + max(ys) - min(ys) <= SETTINGS.dispersion_deg


def identified(segment: list[Plain]) -> list[tuple[float, float, float, float]]:
    """Return the fixations by I-DT as Salvucci & Goldberg (2000) print it."""
    found, start = [], 0
    while start < len(segment):
        end = start + 2
        while end <= len(segment) and covered_ns(segment[start:end]) < SETTINGS.minimum_duration_s * NS:
            end += 1
        if end > len(segment):
            break
        if not small(segment[start:end]):
            start += 1
            continue
        while end < len(segment) and small(segment[start : end + 1]):
            end += 1
        window = segment[start:end]
        x, y = statistics.fmean(p[1] for p in window), statistics.fmean(p[2] for p in window)
        found.append((window[0][0] / NS, covered_ns(window) / NS, x, y))
        start = end
    return found


def covered_ns(window: list[Plain]) -> int:
    return window[-1][0] + window[-1][3] - window[0][0]


@pytest.mark.parametrize("path", RECORDINGS, ids=lambda p: p.name)
def test_online_detection_matches_the_plain_algorithm_over_the_whole_recording(path: Path) -> None:
    samples = recording(path)
    expected = [f for s in segments(samples) for f in identified(smoothed(s))]
    _, facts = played(samples, 10)
    found = [(f.start_s, f.duration_s, f.x, f.y) for f in fixations(facts)]
    assert len(found) == len(expected) > 3
    for ours, plain in zip(found, expected, strict=True):
        assert ours == pytest.approx(plain, abs=1e-9)


def steady(seconds: float, x: float = 0.5, start: float = 0.0) -> tuple[list[float], list[float | None]]:
    n = round(seconds * HZ)
    return [start + i / HZ for i in range(n)], [x] * n


def test_steady_gaze_is_one_fixation_with_dwell_from_its_first_sample() -> None:
    t, x = steady(0.5)
    _, facts = fold(configured_session(), points(0, t, x), session("ending"))
    (found,) = fixations(facts)
    assert found.start_s == 0.0
    assert found.duration_s == pytest.approx(0.5 - 1 / HZ)
    assert (found.x, found.y, found.aoi) == (pytest.approx(0.5), 0.5, "middle")
    assert last(facts).gaze.weights["middle"] == pytest.approx(1 / 3 + 0.5 - 1 / HZ)


def test_gaze_shorter_than_the_minimum_is_not_a_fixation() -> None:
    t, x = steady(0.05)
    _, facts = fold(configured_session(), points(0, t, x), session("ending"))
    assert fixations(facts) == []
    assert last(facts).gaze.weights["middle"] == pytest.approx(1 / 3)


def test_saccade_ends_one_fixation_and_begins_the_next() -> None:
    t0, x0 = steady(0.3, 0.2)
    t1, x1 = steady(0.3, 0.8, start=0.3)
    _, facts = fold(configured_session(), points(0, t0 + t1, x0 + x1), session("ending"))
    assert [f.aoi for f in fixations(facts)] == ["left", "right"]
    assert last(facts).gaze.fixations == 2
    assert last(facts).gaze.aoi == "right"


@pytest.mark.parametrize(("lost_s", "count"), [(0.05, 1), (0.07, 1), (0.09, 2), (0.3, 2)])
def test_loss_longer_than_the_gap_ends_a_fixation_and_is_not_dwell(lost_s: float, count: int) -> None:
    t0, x0 = steady(0.3)
    n = round(lost_s * HZ)
    lost = [0.3 + i / HZ for i in range(n)]
    t1, x1 = steady(0.3, start=0.3 + n / HZ)
    _, facts = fold(configured_session(), points(0, t0 + lost + t1, [*x0, *[None] * n, *x1]), session("ending"))
    assert len(fixations(facts)) == count
    assert last(facts).gaze.weights["middle"] == pytest.approx(1 / 3 + 0.6 - 1 / HZ)


def test_sample_stands_for_the_maximum_gap_at_most() -> None:
    _, facts = fold(configured_session(), points(0, [0.0, 0.1, 0.2, 0.3], [0.5] * 4), session("ending"))
    assert len(fixations(facts)) == 1
    assert last(facts).gaze.weights["middle"] == pytest.approx(1 / 3 + 3 * 0.075)


def test_pause_without_samples_ends_a_fixation_as_a_loss_does() -> None:
    t0, x0 = steady(0.3)
    t1, x1 = steady(0.3, start=0.6)
    _, facts = fold(configured_session(), points(0, t0 + t1, x0 + x1), session("ending"))
    assert len(fixations(facts)) == 2


def test_single_outlier_does_not_end_a_fixation() -> None:
    t, x = steady(0.5)
    x[70] = 0.95
    _, facts = fold(configured_session(), points(0, t, x), session("ending"))
    assert len(fixations(facts)) == 1
    assert last(facts).gaze.weights["right"] < 1 / 3


def test_camera_at_30_hz_gives_the_weights_of_a_tracker_at_1000_hz() -> None:
    def gaze(hz: int) -> dict[str, float]:
        t = [i / hz for i in range(round(1.5 * hz))]
        x: list[float | None] = [0.2 if s < 0.6 else 0.5 if s < 1.1 else 0.8 for s in t]
        _, facts = fold(configured_session(), points(0, t, x), session("ending"))
        return last(facts).gaze.weights

    assert gaze(30) == pytest.approx(gaze(1000), abs=0.05)
    assert gaze(100) == pytest.approx(gaze(1000), abs=0.015)


def test_gaze_beside_every_area_is_on_no_aoi() -> None:
    half = study(aois=[{"name": "left", "rectangle": [0, 0, 0.5, 1]}, {"name": "top", "rectangle": [0.5, 0, 1, 0.2]}])
    t, x = steady(0.5, 0.9)
    _, facts = fold(configured_session(half), points(0, t, x), session("ending"))
    assert last(facts).gaze.category == "uncertain"
    assert last(facts).gaze.weights == {"left": 0.5, "top": 0.5}
    assert [f.aoi for f in fixations(facts)] == [""]


def test_memory_of_the_detector_is_bounded_at_any_rate() -> None:
    state = configured_session(study(fixation={"minimum_duration_s": 100.0, "median_filter_s": 10.0}))
    for seq in range(30):
        t = [(seq * 100 + i) * 1e-6 for i in range(100)]
        state, _ = fold(state, points(seq, t, [0.5] * 100))
    assert state.stream is not None
    assert len(state.stream.detector.filter.points) <= 257
    assert len(state.stream.detector.candidate) <= 1024
