"""Decisions under disturbed gaze: the disturbances are as described, and what is counted is what a loop counts."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from shift_analysis.robustness import (
    DISTURBANCES,
    Disturbance,
    Robustness,
    robustness,
    robustness_of,
)
from shift_schemas.messages import GazeChunk
from shift_study.constants import FixationSettings
from support.verify_sessions import Session

SCREEN = FixationSettings(screen_width_cm=50.0, screen_height_cm=25.0, distance_cm=100.0)


def disturbed(disturbance: Disturbance, chunk: GazeChunk, seed: int = 7) -> GazeChunk | None:
    return disturbance.alternative(SCREEN, seed).gaze_of(chunk)


def chunk(samples: int = 10, seq: int = 0, x: float | None = 0.5) -> GazeChunk:
    return GazeChunk(
        source="tx", seq=seq, t=[seq + i / 100 for i in range(samples)], x=[x] * samples, y=[0.5] * samples,
        valid=[x is not None] * samples,
    )  # fmt: skip


def by_name(name: str) -> Disturbance:
    return next(each for each in DISTURBANCES if each.name == name)


def test_there_are_27_disturbances() -> None:
    names = [each.name for each in DISTURBANCES]
    assert len(set(names)) == 27
    assert {"0.5 deg right", "1 deg up left", "2 deg down", "noise 0.5 deg", "one of 2 samples"} <= set(names)


@pytest.mark.parametrize(
    ("name", "right", "down"),
    [("1 deg right", 1, 0), ("2 deg down", 0, 2), ("0.5 deg up left", -0.5 / math.sqrt(2), -0.5 / math.sqrt(2))],
)
def test_points_are_moved_by_the_angle(name: str, right: float, down: float) -> None:
    moved = disturbed(by_name(name), chunk())
    assert moved is not None
    assert moved.x is not None
    assert moved.y is not None
    assert moved.t == chunk().t
    assert moved.x == pytest.approx([0.5 + 100 * math.tan(math.radians(right)) / 50] * 10, rel=1e-3, abs=1e-9)
    assert moved.y == pytest.approx([0.5 + 100 * math.tan(math.radians(down)) / 25] * 10, rel=1e-3, abs=1e-9)


def test_lost_samples_stay_lost_and_names_of_areas_stay() -> None:
    lost = disturbed(by_name("1 deg right"), chunk(x=None))
    assert lost is not None
    assert lost.x == [None] * 10
    names = GazeChunk(source="tx", seq=0, t=[0.0, 0.1], aoi=["left", None])
    assert disturbed(by_name("1 deg right"), names) == names
    assert disturbed(by_name("noise 0.5 deg"), names) == names


def test_noise_is_normal_and_repeatable() -> None:
    noise = by_name("noise 0.5 deg")
    xs, ys = [], []
    for seq in range(200):
        given = disturbed(noise, chunk(seq=seq))
        assert given == disturbed(noise, chunk(seq=seq))
        assert given is not None
        xs += [(x - 0.5) * 50 for x in given.x or [] if x is not None]
        ys += [(y - 0.5) * 25 for y in given.y or [] if y is not None]
    spread = 100 * math.tan(math.radians(0.5))
    for values in (xs, ys):
        assert abs(np.mean(values)) < 4 * spread / math.sqrt(len(values))
        assert np.std(values) == pytest.approx(spread, rel=0.06)
    assert abs(np.corrcoef(xs, ys)[0, 1]) < 0.1
    assert disturbed(noise, chunk(), seed=8) != disturbed(noise, chunk(), seed=7)


@pytest.mark.parametrize(("every", "samples"), [(2, 10), (5, 10), (5, 3), (2, 1), (5, 7)])
def test_one_of_so_many_samples_is_kept(every: int, samples: int) -> None:
    kept = []
    for seq in range(40):
        given = disturbed(by_name(f"one of {every} samples"), chunk(samples, seq))
        kept += given.t if given is not None else []
    everything = [t for seq in range(40) for t in chunk(samples, seq).t]
    assert kept == everything[::every]


def test_counts_are_those_of_a_loop(tmp_path: Path) -> None:
    path = Session(seed=2).interactions(30).ended().finished(tmp_path)
    found = robustness_of(path)
    assert found.problem == ""
    assert found.has_points
    assert set(found.stands) == {each.name for each in DISTURBANCES}
    assert all(each.decisions == 30 for each in found.stands.values())
    assert any(each.gaze < 30 for each in found.stands.values())
    shares = Robustness([found]).as_json()["all"]["noise 0.5 deg"]
    assert shares == {
        "decisions": 30, "strategy": found.stands["noise 0.5 deg"].strategy / 30,
        "cognitive_state": found.stands["noise 0.5 deg"].cognitive_state / 30,
        "gaze": found.stands["noise 0.5 deg"].gaze / 30,
    }  # fmt: skip


def test_tiny_disturbance_changes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a disturbance every decision stands, also those that a person overrode."""
    nothing = (Disturbance("nothing"), Disturbance("hardly", shift_deg=1e-9))
    monkeypatch.setattr("shift_analysis.robustness.DISTURBANCES", nothing)
    found = robustness_of(Session(seed=3).interactions(40).ended().finished(tmp_path))
    for each in found.stands.values():
        assert (each.decisions, each.strategy, each.cognitive_state, each.gaze) == (40, 40, 40, 40)


def test_participants_and_problems_are_told_apart(tmp_path: Path) -> None:
    good = Session(seed=4).interactions(5).ended().finished(tmp_path)
    bad = tmp_path / "bad.mcap"
    bad.write_bytes(b"nothing")
    found = Robustness(list(robustness([bad, good], workers=2)))
    assert list(found.problems) == ["bad.mcap"]
    assert found.participants == ("P01",)
    assert found.as_json()["participants"]["P01"] == found.as_json()["all"]
    assert found.as_json()["recordings"] == 1
