"""Figures without a screen (matplotlib's Agg), the same bytes for the same numbers.

A figure is as wide as a column of a paper, and no text in it is smaller than 8 points. It says itself what its lines,
bands and bars are and of how many runs. Colours are those of Okabe and Ito, which people with colour blindness tell
apart; dashes and markers tell the curves apart without colour, and the markers of curves that coincide take turns.
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
        "svg.fonttype": "none",  # text stays text: it can be read, searched and tested
        "font.size": 8,
        "axes.titlesize": 8,
        "axes.labelsize": 8,
        "legend.fontsize": 8,
        "lines.linewidth": 1.2,
        "lines.markersize": 3.5,
        "axes.linewidth": 0.6,
    }
)

from matplotlib.figure import Figure  # noqa: E402 (the backend comes first)

WIDTH_IN = 3.5
"""A column of a two-column paper, inches."""
CAPTION_CHARACTERS = 60
"""So many characters of 8 points fit into the width."""
TITLE_CHARACTERS = 20


class Style(NamedTuple):
    """How a curve looks."""

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
"""Okabe and Ito (2008) without their yellow, which is hard to see on white; as many as there are learners."""


def panels(count: int, *heights: float) -> tuple[Any, list[list[Any]]]:
    """Return a figure with ``count`` panels two side by side, for each of ``heights`` (inches) another set of them."""
    columns = min(2, count)
    rows = ceil(count / columns)
    ratios = [height for height in heights for _ in range(rows)]
    figure = Figure(figsize=(WIDTH_IN, sum(ratios) + 1.1), layout="constrained")
    axes = figure.subplots(len(ratios), columns, squeeze=False, height_ratios=ratios)
    found = []
    for kind in range(len(heights)):
        mine = list(axes[kind * rows : (kind + 1) * rows].flat)
        for spare in mine[count:]:
            spare.remove()
        found.append(mine[:count])
    return figure, found


def on_one_scale(axes: Sequence[Any]) -> None:
    """Give the panels the same axes; numbers stand at the left ones only."""
    for i, ax in enumerate(axes[1:], 1):
        ax.sharey(axes[0])
        ax.sharex(axes[0])
        ax.tick_params(labelleft=i % 2 == 0)


def draw_curve(ax: Any, curve: dict[str, Any], style: Style, turn: int, turns: int, label: str) -> None:
    """Draw ``mean`` over the episodes with the band from ``low`` to ``high``.

    ``turn`` of ``turns`` moves the markers, so that each of several curves that coincide shows its own.
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
    """Title each panel by its user; label the axes at the left and at the bottom."""
    columns = min(2, len(axes))
    for i, (ax, name) in enumerate(zip(axes, names, strict=True)):
        short = name if len(name) <= TITLE_CHARACTERS else f"{name[: TITLE_CHARACTERS - 1]}…"
        ax.set_title(f"User {short}", pad=3)
        if i + columns >= len(axes):
            ax.set_xlabel(x)
        if i % columns == 0 and y:
            ax.set_ylabel(y)


def saved(figure: Any, out_dir: Path, name: str) -> list[Path]:
    """Save the figure as ``name.png`` and ``name.svg`` in ``out_dir``."""
    out_dir.mkdir(parents=True, exist_ok=True)
    png, svg = out_dir / f"{name}.png", out_dir / f"{name}.svg"
    figure.savefig(png, dpi=250, metadata={"Software": None})
    figure.savefig(svg, metadata={"Date": None})
    return [png, svg]
