"""What the room view shows: the strategy to say, the person's state, and the equipment. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from shift_schemas.messages import Decision, SessionState, Strategy
from shift_schemas.timestamps import NS
from shift_study.study import Study

from shift_gateway.web.gaze_quality import SourceQuality, qualities
from shift_gateway.web.history import END_OF_TIME, GazeSummary, Places, SessionHistory
from shift_gateway.web.wording import duration, levels, origin, reasons, spoken

WINDOW_S = 180.0
"""The length of the strip at the bottom, seconds."""


@dataclass(frozen=True)
class RoomView:
    """Everything that the room view shows at one time."""

    participant: str = ""
    study: str = ""
    state: SessionState = "live"
    elapsed: str = ""
    decision_number: str = "0"
    planned: str = ""
    task: str = ""
    say: str = "no decision yet"
    strategy: str = ""
    origin: str = ""
    cognitive_state: str = ""
    why: str = ""
    changed_to: str = ""
    """The cognitive state now, if it is another one than that of the last decision."""
    result_pending: str = ""
    capacity: str = ""
    capacity_share: float = 0.0
    """Capacity between its minimum (0) and maximum (1)."""
    threshold_share: float = 0.5
    capacity_class: str = ""
    gaze_class: str = ""
    weights: dict[str, str] = field(default_factory=dict)
    held_aoi: str = ""
    sources: dict[str, SourceQuality] = field(default_factory=dict)
    points: tuple[tuple[str, float, float], ...] = ()
    """Source, x and y of each source's last point, if it is not old."""
    looked_at: tuple[str, ...] = ()
    """The AOIs that sources without points name now."""
    moved: dict[str, tuple[tuple[float, float], ...]] = field(default_factory=dict)
    """The corners of each AOI that moved, 0..1; none for one that is not visible."""
    overrides: dict[str, str] = field(default_factory=dict)
    """By task, the override that its next decision follows."""


def room_view(history: SessionHistory, now_ns: int, at_ns: int = END_OF_TIME) -> RoomView:
    """Return the view.

    Parameters
    ----------
    now_ns
        The time against which ages are measured, ns since the epoch: now, or the time under a recording's cursor.
    at_ns
        Only what was recorded until then counts.
    """
    session, study = history.session(at_ns), history.study(at_ns)
    if session is None or study is None:
        return RoomView()
    decision, observation = history.decisions.last(at_ns), history.observation(at_ns)
    estimated = _estimated(history, decision, at_ns)
    chunks = [c for _, c in history.gaze.between(min(now_ns, at_ns) - 60 * NS, at_ns)]
    seen = qualities(chunks, now_ns)
    capacity = study.capacity
    span = (capacity.max - capacity.min) or 1.0
    ended = session.ended.ns if session.ended else now_ns
    return RoomView(
        participant=session.participant,
        study=session.study,
        state=session.state,
        elapsed=duration((min(now_ns, ended) - session.started.ns) / NS),
        decision_number=str(decision.n if decision else 0),
        planned=str(study.interactions),
        task=decision.task if decision else "",
        say=(decision.text or spoken(decision.strategy)) if decision else "no decision yet",
        strategy=levels(decision.strategy) if decision else "",
        origin=origin(decision) if decision else "",
        cognitive_state=decision.cognitive_state if decision else estimated[0],
        why=reasons(decision.observation) if decision else estimated[1],
        changed_to=estimated[0] if decision and estimated[0] != decision.cognitive_state else "",
        result_pending=_pending(history, decision, now_ns, at_ns) if session.state == "live" else "",
        capacity=f"{observation.capacity.value:.2f}" if observation else "",
        capacity_share=(observation.capacity.value - capacity.min) / span if observation else 0.0,
        threshold_share=(capacity.threshold - capacity.min) / span,
        capacity_class=observation.capacity.category if observation else "",
        gaze_class=observation.gaze.category if observation else "",
        weights={n: f"{w:.2f}" for n, w in observation.gaze.weights.items()} if observation else {},
        held_aoi=observation.gaze.aoi if observation else "",
        sources=seen,
        points=_points(chunks, now_ns),
        looked_at=_looked_at(chunks, now_ns),
        moved=_moved(history.places.last(at_ns), study),
        overrides={task: _override(o.strategy) for task, o in history.pending_overrides(at_ns).items()},
    )


def _estimated(history: SessionHistory, decision: Decision | None, at_ns: int) -> tuple[str, str]:
    """Return the cognitive state now, for the last decision's task, and its reasons."""
    newest = {e.task: e for e in history.estimates.until(at_ns)}
    task = decision.task if decision else ""
    found = newest.get(task) or newest.get("") or next(iter(newest.values()), None)
    return (found.cognitive_state, reasons(found.observation)) if found else ("", "")


def _pending(history: SessionHistory, decision: Decision | None, now_ns: int, at_ns: int) -> str:
    """Return for how long the result of the last decision is missing; empty if it is not missing."""
    if decision is None or history.performance_of(decision.decision_id, at_ns) is not None:
        return ""
    return f"RESULT MISSING {max(now_ns - decision.stamp.ns, 0) / NS:.0f} s"


def _last_chunks(chunks: list[GazeSummary], now_ns: int) -> dict[str, GazeSummary]:
    return {c.source: c for c in chunks if not c.late and now_ns - c.received_ns < NS}


def _points(chunks: list[GazeSummary], now_ns: int) -> tuple[tuple[str, float, float], ...]:
    recent = _last_chunks(chunks, now_ns).values()
    return tuple((c.source, c.x, c.y) for c in recent if c.x is not None and c.y is not None)


def _looked_at(chunks: list[GazeSummary], now_ns: int) -> tuple[str, ...]:
    return tuple(sorted({c.aoi for c in _last_chunks(chunks, now_ns).values() if c.aoi}))


def _moved(places: Places | None, study: Study) -> dict[str, tuple[tuple[float, float], ...]]:
    if places is None:
        return {}
    own = {aoi.name: corners_of(aoi.rectangle or (), aoi.polygon or ()) for aoi in study.aois}
    found = {}
    for name, aoi in places.aois.items():
        corners = corners_of(aoi.rectangle, tuple(zip(aoi.polygon_x, aoi.polygon_y, strict=True)))
        found[name] = (corners or own.get(name, ())) if aoi.visible else ()
    return found


def corners_of(rectangle: Sequence[float], polygon: Sequence[Sequence[float]]) -> tuple[tuple[float, float], ...]:
    """Return the corners of a rectangle (left, top, right, bottom) or of a polygon; the other one is empty."""
    if rectangle:
        left, top, right, bottom = rectangle
        return (left, top), (right, top), (right, bottom), (left, bottom)
    return tuple((corner[0], corner[1]) for corner in polygon)


def _override(strategy: Strategy) -> str:
    return spoken(strategy) or levels(strategy)
