"""The figures of ``evaluate`` describe and show all of their data."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from itertools import combinations, pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from shift_learner.learners import LEARNERS
from shift_simulator import compare, figures, user_study
from shift_simulator.compare import draw_learners
from shift_simulator.figures import STYLES
from shift_simulator.user_study import draw_users
from shift_simulator.users import paper_user

ROOT = Path(__file__).resolve().parents[2]
SVG = "{http://www.w3.org/2000/svg}"


def text_of(svg: Path) -> str:
    """Return all text of the figure in one line."""
    texts = ("".join(element.itertext()) for element in ElementTree.parse(svg).iter(f"{SVG}text"))
    return " ".join(" ".join(texts).split())


@pytest.fixture(scope="module")
def learners() -> dict[str, Any]:
    people = [paper_user("A"), paper_user("B").model_copy(update={"user": "a-person-with-a-rather-long-name"})]
    return compare.compare(["scoring", "thompson", "q-learning"], people, 3, 20, False, lambda _: None)


def test_users_figure_describes_its_band_and_number_of_runs(tmp_path: Path) -> None:
    draw_users(user_study.users(5, 12), tmp_path)
    text = text_of(tmp_path / "users.svg")
    assert "mean of n = 12 simulated runs (seed 5)" in text
    assert "Band: the middle 80 % of the runs (10th to 90th percentile)" in text
    for label in ("with scoring prior", "without prior", "User A", "User D", "episode", "cumulative reward"):
        assert label in text


def test_learners_figure_describes_its_bands_bars_and_number_of_runs(tmp_path: Path, learners: dict[str, Any]) -> None:
    draw_learners(learners, tmp_path)
    text = text_of(tmp_path / "learners.svg")
    assert "Means of n = 20 simulated runs (seed 3)" in text
    assert "band: 95 % interval of the mean (± 1.96 standard errors)" in text
    assert "bar: the middle 80 % of the runs (10th to 90th percentile)" in text
    assert "User a-person-with-a-rat…" in text
    for name in ("scoring", "thompson", "q-learning"):
        assert text.count(name) >= 2, "once in the legend and once at its line"


@pytest.mark.parametrize("name", ["users", "learners"])
def test_figures_in_the_documentation_have_these_captions(name: str) -> None:
    text = text_of(ROOT / "docs" / "figures" / f"{name}.svg")
    runs = {"users": 500, "learners": 200}[name]
    assert f"n = {runs} simulated runs (seed 0)" in text
    assert "10th to 90th percentile" in text


def test_bands_and_bars_show_the_described_intervals(learners: dict[str, Any]) -> None:
    rewards = compare.rewards_of("q-learning", paper_user("A"), 3, 20)
    curve = next(c for c in learners["curves"] if (c["learner"], c["user"]) == ("q-learning", "A"))
    row = next(r for r in learners["results"] if (r["learner"], r["user"]) == ("q-learning", "A"))
    for episode, values in enumerate(rewards):
        half = 1.96 * np.std(values, ddof=1) / 20**0.5
        assert curve["low"][episode] == pytest.approx(np.mean(values) - half)
        assert curve["high"][episode] == pytest.approx(np.mean(values) + half)
    assert [row["reward_low"], row["reward_high"]] == pytest.approx(np.percentile(rewards[-1], [10, 90]).tolist())


@pytest.mark.parametrize("users", [1, 2, 3])
def test_each_user_has_a_panel(
    tmp_path: Path, learners: dict[str, Any], users: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[Any] = []
    monkeypatch.setattr(figures, "save_figure", lambda figure, out, name: drawn.append(figure) or [])
    first = [c for c in learners["curves"] if c["user"] == "A"]
    rows = [r for r in learners["results"] if r["user"] == "A"]
    names = [f"u{n}" for n in range(users)]
    many = {
        "curves": [c | {"user": name} for name in names for c in first],
        "results": [r | {"user": name} for name in names for r in rows],
    }
    draw_learners(learners | many, tmp_path)
    titles = [ax.get_title() for ax in drawn[0].axes]
    assert titles == [f"User {name}" for name in names] * 2


def test_text_has_at_least_8_points_at_column_width(
    tmp_path: Path, learners: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[Any] = []
    monkeypatch.setattr(figures, "save_figure", lambda figure, out, name: drawn.append(figure) or [])
    draw_learners(learners, tmp_path)
    draw_users(user_study.users(0, 2), tmp_path)
    for figure in drawn:
        assert figure.get_figwidth() == 3.5
        figure.draw_without_rendering()
        sizes = {
            text.get_fontsize() for text in figure.findobj(lambda a: hasattr(a, "get_fontsize")) if text.get_text()
        }
        assert min(sizes) >= 8


def test_styles_of_learners_differ_even_without_colour() -> None:
    assert len(STYLES) >= len(LEARNERS)
    for one, other in combinations(STYLES, 2):
        assert one.dash != other.dash
        assert one.marker != other.marker
        assert np.abs(np.subtract(to_rgb(one.colour), to_rgb(other.colour))).max() > 0.2


def test_markers_of_coinciding_curves_alternate(
    tmp_path: Path, learners: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[Any] = []
    monkeypatch.setattr(figures, "save_figure", lambda figure, out, name: drawn.append(figure) or [])
    draw_learners(learners, tmp_path)
    lines = [line for line in drawn[0].axes[0].lines if line.get_marker() not in ("None", None, "")]
    places = [set(range(*np.array([line.get_markevery()[0], 100, line.get_markevery()[1]]))) for line in lines]
    assert len(lines) == 3
    for one, other in combinations(places, 2):
        assert not one & other
    for place in places:
        assert all(b - a <= 25 for a, b in pairwise(sorted(place)))
