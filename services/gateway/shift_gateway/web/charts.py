"""ECharts options of the charts. Pure. The charts' colours, also the dark ones, are in ``assets/page.js``."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

from shift_schemas.timestamps import NS

from shift_gateway.web.history import SessionHistory
from shift_gateway.web.room_view import WINDOW_S

POINT_NS = NS // 2
"""The strip has at most one point in this time, ns; chosen."""
GAP_S = 1.0
"""A longer time without a valid sample is drawn as a gap, seconds; chosen."""


def strip_options(aois: Sequence[str], threshold: float) -> dict[str, Any]:
    """Return the options of the strip: capacity and focus shift above, the AOI that is looked at below.

    The browser adds the points (``shift.strip`` in ``page.js``). Times are milliseconds since the epoch.
    """
    time_axis = {"type": "time", "axisLabel": {"hideOverlap": True}, "splitNumber": 6}
    return {
        "animation": False,
        "aria": {"enabled": True, "decal": {"show": True}},
        "legend": {"data": ["capacity", "focus shift"], "left": 90, "top": "55%", "icon": "roundRect", "itemHeight": 4},
        "grid": [
            {"left": 90, "right": 12, "top": 26, "height": "42%"},
            {"left": 90, "right": 12, "bottom": 24, "height": f"{min(8 + 7 * len(aois), 34)}%"},
        ],
        "xAxis": [
            {**time_axis, "gridIndex": 0, "axisLabel": {"show": False}},
            {**time_axis, "gridIndex": 1},
        ],
        "yAxis": [
            {"gridIndex": 0, "type": "value", "min": 0, "max": 1, "interval": 0.5},
            {"gridIndex": 1, "type": "category", "data": list(aois), "axisTick": {"show": False}},
        ],
        "series": [
            {
                "name": "capacity", "type": "line", "step": "end", "showSymbol": False, "lineStyle": {"width": 3},
                "data": [], "markArea": {"silent": True, "data": []}, "markLine": {"silent": True, "data": []},
            },
            {
                "name": "focus shift", "type": "line", "showSymbol": False,
                "lineStyle": {"width": 2, "type": "dashed"}, "data": [],
            },
            {
                "name": "AOI", "type": "scatter", "symbol": "rect", "symbolSize": [3, 14],
                "xAxisIndex": 1, "yAxisIndex": 1, "data": [], "silent": True,
            },
        ],
        "threshold": threshold,
    }  # fmt: skip


def strip_points(history: SessionHistory, after_ns: int, until_ns: int) -> list[list[Any]]:
    """Return the new points of the strip: time in ms, capacity, focus shift, AOI ('' is none).

    Of the observations within :data:`POINT_NS`, which is three pixels, the last one counts.
    """
    last = {ns // POINT_NS: (ns, point) for ns, point in history.observations.between(after_ns, until_ns)}
    return [
        [ns // 1_000_000, round(point.capacity, 4), round(point.focus_shift, 4), point.aoi]
        for ns, point in last.values()
    ]


def strip_marks(history: SessionHistory, now_ns: int) -> dict[str, Any]:
    """Return what is drawn over the strip: decisions and markers as ``[ms, label]``, gaps as ``[first, last]``, ms.

    A marker that was retracted is not drawn.
    """
    first_ns = now_ns - int(WINDOW_S * 1e9)
    decisions = [[ns // 1_000_000, str(d.n)] for ns, d in history.decisions.between(first_ns, now_ns)]
    found = history.markers.between(first_ns, now_ns)
    retracted = {marker.retracts for _, marker in history.markers.between(-1, now_ns) if marker.retracts}
    kept = [(ns, marker) for ns, marker in found if not marker.retracts and marker.marker_id not in retracted]
    markers = [[ns // 1_000_000, shortened(marker.text)] for ns, marker in kept]
    return {"decisions": decisions, "markers": markers, "gaps": gaps(history, first_ns, now_ns)}


def gaps(history: SessionHistory, first_ns: int, last_ns: int) -> list[list[int]]:
    """Return the times without valid gaze that are longer than :data:`GAP_S`, as ``[first, last]`` in ms."""
    valid = [ns for ns, chunk in history.gaze.between(first_ns, last_ns) if chunk.valid and not chunk.late]
    if not len(history.gaze):
        return []
    edges = [max(first_ns, history.gaze.times[0]), *valid, last_ns]
    limit = int(GAP_S * 1e9)
    pairs = pairwise(edges)
    return [[a // 1_000_000, b // 1_000_000] for a, b in pairs if b - a > limit]


def shortened(text: str, most: int = 24) -> str:
    """Return a label's text, cut at ``most`` characters."""
    return text if len(text) <= most else text[: most - 1] + "…"
