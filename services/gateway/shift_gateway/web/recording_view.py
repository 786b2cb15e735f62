"""What the page of a recording shows: its time line and the table of its events. Pure."""

from __future__ import annotations

import json
from itertools import pairwise
from math import ceil
from typing import Any, Literal, NamedTuple

from shift_schemas.messages import Config, Decision, Override

from shift_gateway.web.charts import gaps, shortened
from shift_gateway.web.history import END_OF_TIME, SessionHistory
from shift_gateway.web.recording_history import RecordingHistory
from shift_gateway.web.recording_summary import is_blinded
from shift_gateway.web.recordings_view import BLINDED
from shift_gateway.web.table_rows import Button, Cell, Row
from shift_gateway.web.wording import date_and_time, duration, levels, origin

MOST_POINTS = 3000
"""A curve has at most this many points; more would not be seen on a screen. Chosen."""
LINKED = 4
"""The number of charts that share the time axis."""
TIME_AXIS = {"type": "value", "axisLabel": {":formatter": "shift.position"}, "axisTick": {"show": False}}
NEUTRAL, CURSOR, FIRST, SECOND = "rgba(125,135,145,.35)", "#d1495b", "#1a85c4", "#d55e00"
"""Colours that are seen on light and on dark ground."""
SEEK = "recording-seek"
"""The browser's event for a position that was chosen in the time line or in the table, seconds."""
EventKind = Literal["session", "decision", "result", "override", "marker", "change", "gap"]


class Event(NamedTuple):
    """One row of the table beside the time line."""

    position_s: float
    kind: EventKind
    what: str


class Head(NamedTuple):
    """The lines above the time line."""

    title: str
    facts: str


def recording_head(recording: RecordingHistory, name: str) -> Head:
    """Return whose recording it is. The condition of a blinded study is hidden."""
    session = recording.history.session()
    if session is None:
        return Head(name, "The start of the session is not in this file.")
    config = recording.history.configs.last()
    hidden = session.condition and is_blinded(config.study if config else "")
    condition = BLINDED if hidden else (session.condition or "no condition")
    parts = [
        f"participant {session.participant}", f"study {session.study}", f"condition {condition}",
        f"seed {session.seed}", f"started {date_and_time(session.started.ns)}",
        f"length {duration(recording.length_s)}",
    ]  # fmt: skip
    return Head(name, " · ".join(parts))


# --- the time line ---


def timeline_options(recording: RecordingHistory) -> dict[str, Any]:
    """Return the ECharts options of the time line. Times are seconds from the session's start."""
    history = recording.history
    decisions = [(recording.position_s(ns), d) for ns, d in _entries(history, "decisions")]
    states = _names([d.cognitive_state for _, d in decisions])
    strategies = _names([levels(d.strategy) for _, d in decisions])
    length = max(recording.length_s, 1.0)
    return {
        "animation": False,
        "aria": {
            "enabled": True, "decal": {"show": True},
            "label": {"description": "The time line of the session. The table of events below says the same in words."},
        },
        "tooltip": {"trigger": "axis", "renderMode": "richText", "axisPointer": {"type": "line"}, "confine": True},
        "axisPointer": {"link": [{"xAxisIndex": "all"}]},
        "legend": {"data": ["capacity", "focus shift", "markers", "reward", "cumulative reward"], "top": 0},
        "dataZoom": [{"type": "slider", "xAxisIndex": list(range(LINKED)), "bottom": 4, "height": 18,
                      "labelFormatter": "", "filterMode": "none"}],
        "grid": _grids(len(states), len(strategies)),
        "xAxis": [
            {**TIME_AXIS, "gridIndex": i, "min": 0, "max": length,
             "axisLabel": {**TIME_AXIS["axisLabel"], "show": i == LINKED - 1}}  # type: ignore[dict-item]
            for i in range(LINKED)
        ],
        "yAxis": [
            {"gridIndex": 0, "type": "value", "min": 0, "max": 1, "interval": 0.5},
            {"gridIndex": 1, "type": "category", "data": states, "axisTick": {"show": False}},
            {"gridIndex": 2, "type": "category", "data": strategies, "axisTick": {"show": False}},
            {"gridIndex": 3, "type": "value", "name": "", "splitNumber": 2},
            {"gridIndex": 3, "type": "value", "position": "right", "splitNumber": 2, "splitLine": {"show": False}},
        ],
        "series": [
            *_curves(recording), _markers(recording),
            _steps("state", 1, [[s, d.cognitive_state] for s, d in decisions], length),
            _steps("strategy", 2, [[s, levels(d.strategy)] for s, d in decisions], length),
            *_rewards(recording), _cursor(),
        ],
    }  # fmt: skip


def timeline_height(options: dict[str, Any]) -> int:
    """Return the height of the time line, px."""
    return sum(int(grid["height"]) for grid in options["grid"]) + 26 + 12 * (LINKED - 1) + 60


def _grids(states: int, strategies: int) -> list[dict[str, Any]]:
    found, top = [], 26
    for height in (110, 20 + 17 * max(states, 1), 20 + 17 * max(strategies, 1), 80):
        found.append({"left": 190, "right": 50, "top": top, "height": height})
        top += height + 12
    return found


def _curves(recording: RecordingHistory) -> list[dict[str, Any]]:
    points = recording.history.observations
    times = [recording.position_s(ns) for ns in points.times]
    capacity = [(s, point.capacity) for s, point in zip(times, points.items, strict=True)]
    shift = [(s, point.focus_shift) for s, point in zip(times, points.items, strict=True)]
    return [
        {"name": "capacity", "type": "line", "step": "end", "showSymbol": False, "lineStyle": {"width": 2},
         "data": thinned(capacity), "markArea": {
             "silent": True, "itemStyle": {"color": NEUTRAL},
             "data": [[{"xAxis": first}, {"xAxis": last}] for first, last in gaze_gaps(recording)]}},
        {"name": "focus shift", "type": "line", "showSymbol": False, "lineStyle": {"width": 1, "type": "dashed"},
         "data": thinned(shift)},
    ]  # fmt: skip


def _markers(recording: RecordingHistory) -> dict[str, Any]:
    markers = _entries(recording.history, "markers")
    return {
        "name": "markers", "type": "scatter", "symbol": "triangle", "symbolRotate": 180, "symbolSize": 11,
        "data": [{"value": [recording.position_s(ns), 0.95], "name": shortened(m.text, 60)} for ns, m in markers],
        "tooltip": {":formatter": "(p) => p.name"},
    }  # fmt: skip


def _steps(name: str, axis: int, data: list[list[Any]], length: float) -> dict[str, Any]:
    """Return a line that stays at each value until the next one. The last value lasts until the end."""
    return {
        "name": name, "type": "line", "step": "end", "xAxisIndex": axis, "yAxisIndex": axis, "symbolSize": 7,
        "symbol": "circle", "color": FIRST, "showSymbol": len(data) <= 200, "lineStyle": {"width": 2},
        "data": [*data, {"value": [length, data[-1][1]], "symbol": "none"}] if data else [],
    }  # fmt: skip


def _rewards(recording: RecordingHistory) -> list[dict[str, Any]]:
    results = [(recording.position_s(ns), p) for ns, p in _entries(recording.history, "performances")]
    axes = {"xAxisIndex": 3, "color": SECOND}
    sums = [[s, round(p.cumulative_reward, 4)] for s, p in results]
    return [
        {"name": "reward", "type": "scatter", "symbol": "diamond", "symbolSize": 10, "yAxisIndex": 3,
         "data": [[s, round(p.reward, 4)] for s, p in results], **axes},
        {"name": "cumulative reward", "type": "line", "step": "end", "showSymbol": False, "yAxisIndex": 4,
         "lineStyle": {"width": 2}, "data": sums, **axes, "color": FIRST},
    ]  # fmt: skip


def _cursor() -> dict[str, Any]:
    """Return a line without points that carries the cursor, which the browser moves (``shift.cursor``)."""
    style = {"color": CURSOR, "width": 2, "type": "solid"}
    mark = {"silent": True, "symbol": "none", "animation": False, "label": {"show": False}, "lineStyle": style}
    return {"id": "cursor", "type": "line", "data": [], "markLine": {**mark, "data": []}}


def thinned(points: list[tuple[float, float]], most: int = MOST_POINTS) -> list[list[float]]:
    """Return a curve with at most ``most`` points. It keeps the smallest and the largest value of each stretch."""
    if len(points) > most:
        width = -(-len(points) // (most // 2))
        kept: list[tuple[float, float]] = []
        for first in range(0, len(points), width):
            stretch = points[first : first + width]
            ends = (min(stretch, key=lambda p: p[1]), max(stretch, key=lambda p: p[1]))
            kept += sorted(set(ends))
        points = kept
    return [[round(s, 3), round(value, 4)] for s, value in points]


def gaze_gaps(recording: RecordingHistory) -> list[tuple[float, float]]:
    """Return the times without valid gaze, as positions in seconds."""
    last_ns = recording.at_ns(recording.length_s)
    found = gaps(recording.history, recording.first_ns, last_ns)
    return [(recording.position_s(a * 1_000_000), recording.position_s(b * 1_000_000)) for a, b in found]


# --- the table ---


def events(recording: RecordingHistory) -> list[Event]:
    """Return everything that happened, in the order of time."""
    history = recording.history
    found = [Event(first, "gap", f"no valid gaze for {last - first:.1f} s") for first, last in gaze_gaps(recording)]

    def add(name: str, kind: EventKind, what: Any) -> None:
        found.extend(Event(recording.position_s(ns), kind, what(x)) for ns, x in _entries(history, name))

    add("sessions", "session", lambda s: f"the session is {s.state}")
    add("decisions", "decision", _decision_text)
    add("performances", "result", _result_text)
    add("overrides", "override", _override_text)
    retracted = {m.retracts for m in history.markers.items if m.retracts}
    add("markers", "marker", lambda m: m.text + (" (retracted later)" if m.marker_id in retracted else ""))
    found += [
        Event(recording.position_s(ns), "change", f"configuration {after.version}: {changed_keys(before, after)}")
        for (_, before), (ns, after) in pairwise(_entries(history, "configs"))
    ]
    return sorted(found, key=lambda event: event.position_s)


def event_rows(found: list[Event]) -> list[Row]:
    """Return the rows of the table: the position is a button that moves the cursor there.

    Positions are rounded up to milliseconds, so that the event itself has happened at the cursor.
    """
    return [
        Row([Cell(button=Button(duration(at), SEEK, ceil(1000 * at) / 1000, f"Go to {at:.1f} s")), kind, what])
        for at, kind, what in found
    ]


def changed_keys(before: Config, after: Config) -> str:
    """Return what a configuration changed, such as ``learner.epsilon 0.75 → 0.2``."""
    return "; ".join(_changed(json.loads(before.study), json.loads(after.study), "")) or "nothing changed"


def _changed(before: Any, after: Any, at: str) -> list[str]:
    if isinstance(before, dict) and isinstance(after, dict):
        keys = dict.fromkeys([*before, *after])
        inner = [_changed(before.get(k), after.get(k), f"{at}.{k}" if at else str(k)) for k in keys]
        return [line for lines in inner for line in lines]
    return [] if before == after else [f"{at} {shortened(str(before), 60)} → {shortened(str(after), 60)}"]


def _decision_text(decision: Decision) -> str:
    where = f"{decision.n}, {decision.task}: {levels(decision.strategy)} in {decision.cognitive_state}"
    return f"{where} ({origin(decision)})"


def _override_text(override: Override) -> str:
    what = f"withdraws the override of {override.task}" if override.withdraws else f"next {override.task}: "
    return ", ".join(part for part in (what + levels(override.strategy), override.reason, override.author) if part)


def _result_text(result: Any) -> str:
    sides = [
        f"{name} {'success' if side.success else 'failure'} in {side.duration_s:g} s"
        for name, side in (("comprehension", result.comprehension), ("enabledness", result.enabledness))
    ]
    corrected = ", corrects an earlier report" if result.corrects else ""
    reward = f"reward {result.reward:+.3f}, sum {result.cumulative_reward:+.3f}"
    return f"{result.task}: {', '.join(sides)}; {reward}{corrected}"


def _entries(history: SessionHistory, name: str) -> list[tuple[int, Any]]:
    return list(getattr(history, name).between(-1, END_OF_TIME))


def _names(values: list[str]) -> list[str]:
    """Return the different values in the order in which they are first seen, from the top of the chart down."""
    return list(dict.fromkeys(values))[::-1]
