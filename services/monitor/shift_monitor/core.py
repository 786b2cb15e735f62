"""The monitor's core: the partner model as a fold, ``step(state, event, now) -> Step``. Pure.

It opens nothing and reads no clock: the stamp comes with the event, gaze brings its source's clock along.
Each input that is applied puts out exactly one observation, as the last of its facts, whose ``seen`` says
what was applied; so the order of the inputs can be read from the outputs, and a recording be folded again.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any

from pydantic import TypeAdapter
from shift_schemas.errors import Conflict, Unavailable, UnknownThing
from shift_schemas.messages import (
    CapacityView,
    Config,
    Decision,
    Fact,
    Fixation,
    Gaze,
    GazeChunk,
    GazeOutcome,
    GazeView,
    Observation,
    Performance,
    Seen,
    Session,
)
from shift_schemas.stamps import NS, Stamp
from shift_schemas.step import NotYet, Step

from shift_monitor.areas import area_at
from shift_monitor.attention import Attention, fresh, gaze_class, interrupted
from shift_monitor.awareness import History, awareness_views, reported
from shift_monitor.capacity import Capacity, capacity_class, executed
from shift_monitor.fixation import Found, ended
from shift_monitor.numbering import arrival, came_late, read, skipped
from shift_monitor.plan import Plan, name_of, plan_of
from shift_monitor.stream import (
    UNREAD,
    Stream,
    check_rise,
    check_samples,
    dwelt_on,
    names_applied,
    points_applied,
    points_of,
)

CONFIG_WAIT_S = 0.2
"""How long gaze waits for the session's configuration: it is a stream (DESIGN.md, "Read your own writes")."""

MOST_SOURCES = 256
"""Chosen: gaze sources of one session; each is remembered, so that a former one can be refused."""

LARGEST_COUNT = 2**53
"""The largest count on the wire (shift_schemas.messages)."""


UNSET_CAPACITY, UNSET_ATTENTION = Capacity(0.0), Attention(())
"""Before the first configuration says how they start."""


@dataclass(frozen=True, slots=True)
class MonitorState:
    """One session's partner model. ``load(dump(state)) == state``."""

    session: str
    study: str = ""
    """The study in force as ``config`` carries it; empty before the first."""
    ended: bool = False
    version: int = 0
    capacity: Capacity = UNSET_CAPACITY
    attention: Attention = UNSET_ATTENTION
    awareness: dict[str, History] = field(default_factory=dict)
    stream: Stream | None = None
    former: dict[str, int] = field(default_factory=dict)
    """Sources that were replaced, with their last chunk's number."""
    fixations: int = 0
    dropped: int = 0
    decision: int = 0
    performance: int = 0
    config: int = 0


_STATE = TypeAdapter(MonitorState)


def initial(event: Session) -> MonitorState:
    """The state at the start of a session, before its configuration."""
    return MonitorState(event.session)


def dump(state: MonitorState) -> str:
    """The state as JSON; floats keep every digit."""
    return _STATE.dump_json(state).decode()


def load(text: str) -> MonitorState:
    """The state that :func:`dump` wrote."""
    return _STATE.validate_json(text)


def step(state: MonitorState | None, event: object, now: Stamp, late: bool = False) -> Step[MonitorState]:
    """Apply one message.

    Parameters
    ----------
    state
        None before the session's start.
    now
        The facts' stamp.
    late
        No more waiting for what the message needs to be applied.

    Raises
    ------
    UnknownThing
        There is no such session.
    NotYet
        The session's configuration has not come yet; ``Unavailable`` instead where it is ``late``.
    Conflict
        Gaze for an ended session or from a source that was replaced.
    MalformedMessage
        Gaze on an AOI that the study does not have, or whose time does not rise.
    """
    if isinstance(event, Session):
        return _session(state, event, now)
    if state is None:
        raise UnknownThing("there is no such session here")
    match event:
        case Config():
            return _observed(_configured(state, event), now)
        case Decision():
            return _observed(_decided(state, event, late), now)
        case Performance():
            return _observed(_performed(state, event, late), now)
        case GazeChunk():
            return _gaze(state, event, now, late)
    return Step(state)


def gaze_chunk_of(fact: Gaze) -> GazeChunk:
    """The chunk that this fact records: applying it again gives the same facts."""
    if fact.aoi:
        names = [name or None for name in fact.aoi]
        return GazeChunk(source=fact.source, seq=fact.seq, t=fact.t, aoi=names)
    return GazeChunk(source=fact.source, seq=fact.seq, t=fact.t, x=list(fact.x), y=list(fact.y), valid=fact.valid)


def observation_of(state: MonitorState, now: Stamp) -> Observation:
    """The whole partner model as it goes out."""
    plan = plan_of(state.study)
    study, attention = plan.study, state.attention
    return Observation(
        session=state.session,
        stamp=now,
        seen=_seen(state),
        version=state.version,
        capacity=CapacityView(
            value=state.capacity.value, category=capacity_class(state.capacity.value, study.capacity)
        ),
        gaze=GazeView(
            category=gaze_class(attention, study.attention),
            weights=dict(zip(plan.names, attention.weights, strict=True)),
            focus_shift=attention.focus_shift,
            aoi=name_of(plan, attention.held),
            fixations=state.fixations,
            dropped=state.dropped,
        ),
        awareness=awareness_views(state.awareness, study.awareness),
    )


# --- everything but gaze ---


def _session(state: MonitorState | None, event: Session, now: Stamp) -> Step[MonitorState]:
    if state is None:
        return Step(initial(event))
    if event.state == "live" or state.ended:
        return Step(state)
    if not state.study:
        return Step(replace(state, ended=True))
    after, found = _silenced(replace(state, ended=True))
    return _observed(after, now, tuple(_fixation(after, f, now) for f in found))


def _configured(state: MonitorState, event: Config) -> MonitorState:
    study = plan_of(event.study).study
    state = replace(state, study=event.study, config=event.version)
    if state.attention.weights:
        return state
    return replace(state, capacity=Capacity(study.capacity.start), attention=fresh(len(study.aois)))


def _decided(state: MonitorState, event: Decision, late: bool) -> MonitorState:
    settings = _plan_in_force(state, late).study.capacity
    return replace(state, capacity=executed(state.capacity, event.strategy, settings), decision=event.n)


def _performed(state: MonitorState, event: Performance, late: bool) -> MonitorState:
    _plan_in_force(state, late)
    history = reported(state.awareness.get(event.task, History()), event)
    return replace(state, awareness={**state.awareness, event.task: history}, performance=event.n)


# --- gaze ---


def _gaze(state: MonitorState, chunk: GazeChunk, now: Stamp, late: bool) -> Step[MonitorState]:
    if state.ended:
        raise Conflict(f"session {state.session} has ended")
    plan = _plan_in_force(state, late)
    _check_source(state, chunk)
    check_samples(chunk, plan)
    stream = state.stream
    same = stream is not None and stream.source == chunk.source
    numbering = stream.numbering if stream is not None and same else UNREAD
    result = {"accepted": len(chunk.t), "source": chunk.source, "seq": chunk.seq}
    match arrival(numbering, chunk.seq):
        case "repeat":
            return Step(state, result=result)
        case "late":
            assert stream is not None
            after = replace(state, stream=replace(stream, numbering=came_late(numbering, chunk.seq)))
            return _observed(after, now, (_gaze_fact(after, chunk, now, "late"),), result | {"accepted": 0})
        case "new":
            after, found = _applied(state, chunk, plan)
            facts: Iterator[Fact] = (_fixation(after, f, now) for f in found)
            return _observed(after, now, (_gaze_fact(after, chunk, now, "applied"), *facts), result)


def _applied(state: MonitorState, chunk: GazeChunk, plan: Plan) -> tuple[MonitorState, list[tuple[str, Found]]]:
    """The state after a new chunk, and the fixations that ended with it, with their source."""
    times = [round(t * NS) for t in chunk.t]
    stream = state.stream
    ending: list[tuple[str, Found]] = []
    if stream is None or stream.source != chunk.source:
        check_rise(None, times, chunk)
        state, ending = _silenced(state)
        stream = Stream(chunk.source)
        former = state.stream
        if former is not None:
            state = replace(state, former={**state.former, former.source: former.numbering.last})
    else:
        check_rise(stream.last_ns, times, chunk)
        if stream.last_ns is not None and (chunk.aoi is None) != (stream.named is None):  # another kind of gaze
            state, ending = _silenced(state)
            stream = Stream(chunk.source, stream.numbering)
    dropped = min(state.dropped + skipped(stream.numbering, chunk.seq), LARGEST_COUNT)
    stream = Stream(stream.source, read(stream.numbering, chunk.seq), stream.last_ns, stream.named, stream.detector)
    if chunk.aoi is None:
        stream, attention, found = points_applied(stream, state.attention, times, chunk, plan)
    else:
        stream, attention, found = *names_applied(stream, state.attention, times, chunk.aoi, plan), []
    after = replace(state, stream=stream, attention=attention, dropped=dropped, fixations=state.fixations + len(found))
    return after, [*ending, *((chunk.source, f) for f in found)]


def _silenced(state: MonitorState) -> tuple[MonitorState, list[tuple[str, Found]]]:
    """The state when no more gaze comes from its source: an open fixation ends."""
    if state.stream is None:
        return state, []
    plan, stream = plan_of(state.study), state.stream
    output = ended(stream.detector, plan.rule)
    after = replace(
        state,
        attention=interrupted(dwelt_on(state.attention, output, plan)),
        stream=Stream(stream.source, stream.numbering, stream.last_ns),
        fixations=state.fixations + len(output.found),
    )
    return after, [(stream.source, f) for f in output.found]


# --- what is refused ---


def _check_source(state: MonitorState, chunk: GazeChunk) -> None:
    if chunk.source in state.former:
        speaks = state.stream.source if state.stream else ""
        raise Conflict(f"gaze source {chunk.source} was replaced by {speaks}; begin again under another name")
    if len(state.former) >= MOST_SOURCES and state.stream and state.stream.source != chunk.source:
        raise Conflict(f"session {state.session} had {MOST_SOURCES} gaze sources replaced; it takes no more")


# --- what is put out ---


def _observed(
    state: MonitorState, now: Stamp, facts: tuple[Fact, ...] = (), result: dict[str, Any] | None = None
) -> Step[MonitorState]:
    after = replace(state, version=state.version + 1)
    return Step(after, (*facts, observation_of(after, now)), result or {})


def _gaze_fact(state: MonitorState, chunk: GazeChunk, now: Stamp, outcome: GazeOutcome) -> Gaze:
    columns: dict[str, Any]
    if chunk.aoi is not None:
        columns = {"aoi": [name or "" for name in chunk.aoi]}
    else:
        points = list(points_of(chunk))
        columns = {
            "x": [p[0] if p else 0.0 for p in points],
            "y": [p[1] if p else 0.0 for p in points],
            "valid": [p is not None for p in points],
        }
    return Gaze(
        session=state.session, stamp=now, seen=_seen(state),
        source=chunk.source, seq=chunk.seq, outcome=outcome, t=chunk.t, **columns,
    )  # fmt: skip


def _fixation(state: MonitorState, found: tuple[str, Found], now: Stamp) -> Fixation:
    source, (start_ns, end_ns, x, y) = found
    plan = plan_of(state.study)
    return Fixation(
        session=state.session, stamp=now, seen=_seen(state), source=source, start_s=start_ns / NS,
        duration_s=(end_ns - start_ns) / NS, x=x, y=y, aoi=name_of(plan, area_at(plan.areas, x, y)),
    )  # fmt: skip


def _seen(state: MonitorState) -> Seen:
    gaze = dict(state.former)
    if state.stream is not None:
        gaze[state.stream.source] = state.stream.numbering.last
    return Seen(gaze=gaze, decision=state.decision, performance=state.performance, config=state.config)


# --- the study ---


def _plan_in_force(state: MonitorState, late: bool) -> Plan:
    if state.study:
        return plan_of(state.study)
    if not late:
        raise NotYet(("recorder",), CONFIG_WAIT_S)
    raise Unavailable(f"the monitor has not read the configuration of session {state.session} yet")
