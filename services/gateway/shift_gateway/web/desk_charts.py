"""ECharts options of the desk view's charts, and what changes in them. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from shift_schemas.messages import Decision

from shift_gateway.web.wording import levels


def probability_options() -> dict[str, Any]:
    """Return the options of the bar chart of a decision's probabilities, without its bars."""
    return {
        "animation": False,
        "aria": {"enabled": True, "decal": {"show": True}},
        "legend": {"show": False},
        "grid": {"left": 8, "right": 50, "top": 6, "bottom": 6, "containLabel": True},
        "xAxis": {"type": "value", "min": 0, "max": 1, "interval": 0.25},
        "yAxis": {"type": "category", "inverse": True, "data": [], "axisTick": {"show": False}},
        "series": [{"name": "probability", "type": "bar", "data": [], "label": {"show": True, "position": "right"}}],
    }


def probability_update(decision: Decision | None) -> dict[str, Any]:
    """Return the bars: one for each action, with the chosen one marked in its name."""
    if decision is None:
        return {}
    names = [("→ " if a == decision.strategy else "") + levels(a) for a in decision.actions]
    bars = [{"value": round(p, 4), "label": {"formatter": f"{p:.2f}"}} for p in decision.probabilities]
    return {"yAxis": {"data": names}, "series": [{"data": bars}]}


def reward_options() -> dict[str, Any]:
    """Return the options of the curve of the cumulative reward, without its points."""
    return {
        "animation": False,
        "aria": {"enabled": True},
        "legend": {"show": False},
        "grid": {"left": 8, "right": 16, "top": 26, "bottom": 26, "containLabel": True},
        "xAxis": {"type": "value", "name": "report", "nameLocation": "middle", "nameGap": 24, "minInterval": 1},
        "yAxis": {"type": "value", "name": "cumulative reward", "nameTextStyle": {"align": "left"}, "scale": True},
        "series": [{"type": "line", "data": [], "symbolSize": 5, "lineStyle": {"width": 2}}],
    }


def reward_update(points: Sequence[tuple[int, float]]) -> dict[str, Any]:
    """Return the points of the curve."""
    return {"series": [{"data": [list(point) for point in points]}]}
