"""The figure of a what-if: values with their intervals, and states and strategies side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from shift_simulator.figures import STYLES, WIDTH_IN, save_figure

from shift_analysis.off_policy import Estimate
from shift_analysis.whatif import WhatIf

NAMES = {"logged": "recorded", "ips": "IPS", "snips": "SNIPS", "dr": "doubly robust"}
ROW_IN = 0.26
"""The height of one row, inches."""


def draw_what_if(answer: WhatIf, folder: Path, other: str) -> list[Path]:
    """Draw the figure as PNG and SVG and return both paths. ``other`` names the other policy."""
    from matplotlib.figure import Figure

    values = [*([answer.logged] if answer.logged else []), *answer.value]
    rows = [len(values) or 1, len(answer.states) or 1, len(answer.strategies) or 1]
    figure = Figure(figsize=(WIDTH_IN, ROW_IN * (sum(rows) + 11)), layout="constrained")
    value, states, strategies = figure.subplots(3, 1, height_ratios=rows)
    _draw_values(value, values)
    _draw_counts(states, answer.states, "cognitive state", other)
    _draw_counts(strategies, answer.strategies, "strategy", other)
    handles, labels = states.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=2, frameon=False)
    return save_figure(figure, folder, "whatif")


def _draw_values(ax: Any, values: Sequence[Estimate]) -> None:
    for place, estimate in enumerate(values):
        style = STYLES[0] if estimate.estimator == "logged" else STYLES[1]
        if estimate.low is not None and estimate.high is not None:
            ax.hlines(place, estimate.low, estimate.high, color=style.colour)
        ax.plot(estimate.estimate, place, color=style.colour, marker=style.marker)
    ax.set_yticks(range(len(values)), [NAMES[estimate.estimator] for estimate in values])
    ax.set_ylim(len(values) - 0.5, -0.5)
    ax.set_title("mean reward of a decision", loc="left")
    ax.set_xlabel("reward (95 % interval)")


def _draw_counts(ax: Any, counts: Mapping[str, Sequence[int]], title: str, other: str) -> None:
    places = range(len(counts))
    for turn, name in enumerate(("recorded", other)):
        offset = 0.2 * (2 * turn - 1)
        numbers = [pair[turn] for pair in counts.values()]
        ax.barh([place + offset for place in places], numbers, 0.38, color=STYLES[turn].colour, label=name)
    ax.set_yticks(places, [name.replace("_", " ") for name in counts])
    ax.set_ylim(len(counts) - 0.5, -0.5)
    ax.set_title(title, loc="left")
    ax.set_xlabel("decisions")
