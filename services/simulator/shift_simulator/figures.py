"""Figures without a screen (matplotlib's Agg). The same numbers give the same bytes.

A figure is as wide as one column of a paper, and its smallest text has 8 points. Its caption says what the lines,
bands and bars are, and how many runs they show. The colours are those of Okabe and Ito, which people with colour
blindness can tell apart. Dashes and markers tell the curves apart without colour. Where curves coincide, their
markers alternate.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil
from pathlib import Path
from textwrap import fill
from typing import Any, NamedTuple

import matplotlib

matplotlib.use("Agg")
matplotlib.rcParams.update(
    {
        "svg.hashsalt": "shift",
        "svg.fonttype": "none",  # keep text as text, so that people can search it and tests can read it
        "font.size": 8,
        "axes.titlesize": 8,
        "axes.labelsize": 8,
        "legend.fontsize": 8,
        "lines.linewidth": 1.2,
        "lines.markersize": 3.5,
        "axes.linewidth": 0.6,
    }
)

from matplotlib.figure import Figure  # noqa: E402 (the backend must be chosen first)

WIDTH_IN = 3.5
"""The width of a column in a two-column paper, inches."""
CAPTION_CHARACTERS = 60
"""How many characters of 8 points fit into the width."""
TITLE_CHARACTERS = 20


class Style(NamedTuple):
    """The style of a curve."""

    colour: str
    dash: Any
    marker: str


STYLES: tuple[Style, ...] = (
    Style("#0072B2", "-", "o"),
    Style("#D55E00", (0, (5, 1.5)), "s"),
    Style("#009E73", (0, (1, 1)), "^"),
    Style("#000000", (0, (6, 1.5, 1, 1.5)), "x"),
    Style("#CC79A7", (0, (3, 1)), "D"),
    Style("#E69F00", (0, (4, 1, 1, 1, 1, 1)), "v"),
    Style("#56B4E9", (0, (8, 2)), "*"),
)
"""The colours of Okabe and Ito (2008) without yellow, which is hard to see on white. Each learner has a style."""


def panels(count: int, *heights: float) -> tuple[Any, list[list[Any]]]:
    """Return a figure, and ``count`` panels in two columns for each of ``heights`` (inches)."""
    columns = min(2, count)
    rows = ceil(count / columns)
    ratios = [height for height in heights for _ in range(rows)]
    figure = Figure(figsize=(WIDTH_IN, sum(ratios) + 1.1), layout="constrained")
    axes = figure.subplots(len(ratios), columns, squeeze=False, height_ratios=ratios)
    groups = []
    for kind in range(len(heights)):
        group = list(axes[kind * rows : (kind + 1) * rows].flat)
        for spare in group[count:]:
            spare.remove()
        groups.append(group[:count])
    return figure, groups


def on_one_scale(axes: Sequence[Any]) -> None:
    """Give the panels the same axes, with numbers only at the left panels."""
    for i, ax in enumerate(axes[1:], 1):
        ax.sharey(axes[0])
        ax.sharex(axes[0])
        ax.tick_params(labelleft=i % 2 == 0)


def draw_curve(ax: Any, curve: dict[str, Any], style: Style, turn: int, turns: int, label: str) -> None:
    """Draw ``mean`` over the episodes, with the band from ``low`` to ``high``.

    Curve ``turn`` of ``turns`` has its markers moved, so that the markers of coinciding curves stay visible.
    """
    episodes = range(1, len(curve["mean"]) + 1)
    period = max(turns, len(episodes) // 4)
    ax.fill_between(episodes, curve["low"], curve["high"], color=style.colour, alpha=0.18, linewidth=0)
    ax.plot(
        episodes, curve["mean"], color=style.colour, linestyle=style.dash, marker=style.marker, label=label,
        markevery=(turn * period // turns, period), markerfacecolor="white" if style.marker != "x" else None,
    )  # fmt: skip


def finish(figure: Any, ax: Any, caption: str) -> None:
    """Put the legend of ``ax`` above the panels, and the caption below them."""
    handles, labels = ax.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=2, frameon=False, handlelength=3.5)
    figure.supxlabel(fill(caption, CAPTION_CHARACTERS), fontsize=8, x=0.01, ha="left")


def label_panels(axes: Sequence[Any], names: Sequence[str], x: str, y: str) -> None:
    """Give each panel its user as the title, and label the left and the bottom axes."""
    columns = min(2, len(axes))
    for i, (ax, name) in enumerate(zip(axes, names, strict=True)):
        short = name if len(name) <= TITLE_CHARACTERS else f"{name[: TITLE_CHARACTERS - 1]}…"
        ax.set_title(f"User {short}", pad=3)
        if i + columns >= len(axes):
            ax.set_xlabel(x)
        if i % columns == 0 and y:
            ax.set_ylabel(y)


def save_figure(figure: Any, out_dir: Path, name: str) -> list[Path]:
    """Save the figure as ``name.png`` and ``name.svg`` in ``out_dir``; return both paths."""
    out_dir.mkdir(parents=True, exist_ok=True)
    png, svg = out_dir / f"{name}.png", out_dir / f"{name}.svg"
    figure.savefig(png, dpi=250, metadata={"Software": None})
    figure.savefig(svg, metadata={"Date": None})
    return [png, svg]
