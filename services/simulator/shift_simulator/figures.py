"""Figures without a screen (matplotlib's Agg), the same bytes for the same numbers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
matplotlib.rcParams["svg.hashsalt"] = "shift"
matplotlib.rcParams["font.size"] = 9

from matplotlib.figure import Figure  # noqa: E402 (the backend comes first)


def panels(count: int, height: float = 3.0) -> tuple[Any, list[Any]]:
    """A figure with ``count`` panels side by side on one scale."""
    figure = Figure(figsize=(2.6 * count + 0.6, height), layout="constrained")
    axes = figure.subplots(1, count, sharey=True, squeeze=False)
    return figure, list(axes[0])


def saved(figure: Any, out_dir: Path, name: str) -> list[Path]:
    """The figure as ``name.png`` and ``name.svg`` in ``out_dir``."""
    out_dir.mkdir(parents=True, exist_ok=True)
    png, svg = out_dir / f"{name}.png", out_dir / f"{name}.svg"
    figure.savefig(png, dpi=150, metadata={"Software": None})
    figure.savefig(svg, metadata={"Date": None})
    return [png, svg]
