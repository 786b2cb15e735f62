"""The monitor's core: the partner model as a fold, ``step(state, event, now) -> Step``. Pure.

It opens nothing and reads no clock: the stamp comes with the event, gaze brings its source's clock along.
Each input that is applied puts out exactly one observation, as the last of its facts, whose ``seen`` says
what was applied; so the order of the inputs can be read from the outputs, and a recording be folded again.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any, NamedTuple

from pydantic import TypeAdapter
from shift_schemas.errors import Conflict, FieldError, MalformedMessage, Unavailable, UnknownThing, shorten
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
from shift_schemas.study import Study
from shift_schemas.study_text import study_of

from shift_monitor.areas import NOWHERE, Area, area_at, area_of
from shift_monitor.attention import Attention, Dwell, dwelt, fresh, gaze_class, interrupted, met_aoi
from shift_monitor.awareness import History, awareness_views, reported
from shift_monitor.capacity import Capacity, capacity_class, executed
from shift_monitor.fixation import Detector, Found, Output, Rule, ended, fed, rule_of
from shift_monitor.numbering import Numbering, arrival, came_late, read, skipped

CONFIG_WAIT_S = 0.2
"""How long gaze waits for the session's configuration: it is a stream (DESIGN.md, "Read your own writes")."""

LARGEST_COORDINATE = 100.0
"""Chosen: gaze beside the screen is gaze; a hundred screens beside it is nonsense."""

MOST_SOURCES = 256
"""Chosen: gaze sources of one session; each is remembered, so that a former one can be refused."""

LARGEST_COUNT = 2**53
"""The largest count on the wire (shift_schemas.messages)."""


UNREAD, IDLE = Numbering(), Detector()
"""A source of which nothing was read."""

UNSET_CAPACITY, UNSET_ATTENTION = Capacity(0.0), Attention(())
"""Before the first configuration says how they start."""


class Plan(NamedTuple):
    """A study, prepared for the fold."""

    study: Study
    names: tuple[str, ...]
    targets: dict[str | None, int]
    areas: tuple[Area, ...]
    rule: Rule
    longest_ns: int
    """How long an AOI name stands at most."""


@dataclass(frozen=True, slots=True)
class Stream:
    """The gaze source that speaks."""

    source: str
    numbering: Numbering = UNREAD
    last_ns: int | None = None
    """Time of its last sample."""
    named: int | None = None
    """The last sample's target where it was an AOI name; none: it was a point."""
    detector: Detector = IDLE


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
    plan = _plan(state.study)
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
            aoi=_name(plan, attention.held),
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
    study = _plan(event.study).study
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
    _check_samples(chunk, plan)
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
        _check_rise(None, times, chunk)
        state, ending = _silenced(state)
        stream = Stream(chunk.source)
        former = state.stream
        if former is not None:
            state = replace(state, former={**state.former, former.source: former.numbering.last})
    else:
        _check_rise(stream.last_ns, times, chunk)
        if stream.last_ns is not None and (chunk.aoi is None) != (stream.named is None):  # another kind of gaze
            state, ending = _silenced(state)
            stream = Stream(chunk.source, stream.numbering)
    dropped = min(state.dropped + skipped(stream.numbering, chunk.seq), LARGEST_COUNT)
    stream = Stream(stream.source, read(stream.numbering, chunk.seq), stream.last_ns, stream.named, stream.detector)
    if chunk.aoi is None:
        stream, attention, found = _points(stream, state.attention, times, chunk, plan)
    else:
        stream, attention, found = *_names(stream, state.attention, times, chunk.aoi, plan), []
    after = replace(state, stream=stream, attention=attention, dropped=dropped, fixations=state.fixations + len(found))
    return after, [*ending, *((chunk.source, f) for f in found)]


def _points(
    stream: Stream, attention: Attention, times: list[int], chunk: GazeChunk, plan: Plan
) -> tuple[Stream, Attention, list[Found]]:
    """Points through fixation detection, sample by sample; only what is inside a fixation is dwell."""
    found: list[Found] = []
    detector = stream.detector
    for t_ns, point in zip(times, _columns(chunk), strict=True):
        if not attention.met and point is not None and area_at(plan.areas, *point) != NOWHERE:
            attention = met_aoi(attention)
        detector, output = fed(detector, t_ns, point, plan.rule)
        attention = _dwelt_on(attention, output, plan)
        found += output.found
    return Stream(stream.source, stream.numbering, times[-1], None, detector), attention, found


def _dwelt_on(attention: Attention, output: Output, plan: Plan) -> Attention:
    """The dwell of the samples inside a fixation, each on the AOI that its filtered position falls on."""
    rule, settings = plan.rule, plan.study.attention
    for t_ns, x, y, duration_ns in output.dwells:
        dwell = Dwell(area_at(plan.areas, x, y), t_ns, duration_ns)
        attention = dwelt(attention, dwell, rule.minimum_ns, rule.gap_ns, settings)
    return attention


def _names(
    stream: Stream, attention: Attention, times: list[int], names: list[str | None], plan: Plan
) -> tuple[Stream, Attention]:
    """AOI names as they are: each stands until the next, at most ``attention.maximum_dwell_s``."""
    last_ns, named = stream.last_ns, stream.named
    for t_ns, name in zip(times, names, strict=True):
        if last_ns is not None and named is not None:
            dwell = Dwell(named, last_ns, min(t_ns - last_ns, plan.longest_ns))
            attention = dwelt(attention, dwell, plan.rule.minimum_ns, 0, plan.study.attention)
        last_ns, named = t_ns, plan.targets[name]
        if not attention.met and named != NOWHERE:
            attention = met_aoi(attention)
    return Stream(stream.source, stream.numbering, last_ns, named, stream.detector), attention


def _silenced(state: MonitorState) -> tuple[MonitorState, list[tuple[str, Found]]]:
    """The state when no more gaze comes from its source: an open fixation ends."""
    if state.stream is None:
        return state, []
    plan, stream = _plan(state.study), state.stream
    output = ended(stream.detector, plan.rule)
    after = replace(
        state,
        attention=interrupted(_dwelt_on(state.attention, output, plan)),
        stream=Stream(stream.source, stream.numbering, stream.last_ns),
        fixations=state.fixations + len(output.found),
    )
    return after, [(stream.source, f) for f in output.found]


def _columns(chunk: GazeChunk) -> Iterator[tuple[float, float] | None]:
    """The points of a chunk; none where the sample is lost. Left out, ``valid`` is: where x and y are."""
    valid: list[bool] = chunk.valid if chunk.valid is not None else [True] * len(chunk.t)
    for x, y, ok in zip(chunk.x or [], chunk.y or [], valid, strict=True):
        yield (x, y) if ok and x is not None and y is not None else None


# --- what is refused ---


def _check_source(state: MonitorState, chunk: GazeChunk) -> None:
    if chunk.source in state.former:
        speaks = state.stream.source if state.stream else ""
        raise Conflict(f"gaze source {chunk.source} was replaced by {speaks}; begin again under another name")
    if len(state.former) >= MOST_SOURCES and state.stream and state.stream.source != chunk.source:
        raise Conflict(f"session {state.session} had {MOST_SOURCES} gaze sources replaced; it takes no more")


def _check_samples(chunk: GazeChunk, plan: Plan) -> None:
    if chunk.aoi is not None:
        unknown = next(((i, n) for i, n in enumerate(chunk.aoi) if n not in plan.targets), None)
        if unknown is not None:
            rule = f"one of: {', '.join(plan.names)}; or null for none of them"
            raise _malformed(f"aoi.{unknown[0]}", unknown[1], rule)
    for name, column in (("x", chunk.x), ("y", chunk.y)):
        for i, value in enumerate(column or ()):
            if value is not None and not -LARGEST_COORDINATE <= value <= LARGEST_COORDINATE:
                raise _malformed(f"{name}.{i}", value, "0..1 on the stimulus, and null where gaze is lost")


def _check_rise(last_ns: int | None, times: list[int], chunk: GazeChunk) -> None:
    for i, t_ns in enumerate(times):
        if last_ns is not None and t_ns <= last_ns:
            rule = f"t must rise; the sample before was at {last_ns / NS} s, {chunk.source}'s clock"
            raise _malformed("t" if i == 0 else f"t.{i}", chunk.t[i], rule)
        last_ns = t_ns


def _malformed(name: str, value: object, rule: str) -> MalformedMessage:
    error = FieldError(field=name, value=shorten(value), rule=rule)
    return MalformedMessage(f"gaze: {name}: {error.value}: {rule}", (error,))


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
        points = list(_columns(chunk))
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
    plan = _plan(state.study)
    return Fixation(
        session=state.session, stamp=now, seen=_seen(state), source=source, start_s=start_ns / NS,
        duration_s=(end_ns - start_ns) / NS, x=x, y=y, aoi=_name(plan, area_at(plan.areas, x, y)),
    )  # fmt: skip


def _seen(state: MonitorState) -> Seen:
    gaze = dict(state.former)
    if state.stream is not None:
        gaze[state.stream.source] = state.stream.numbering.last
    return Seen(gaze=gaze, decision=state.decision, performance=state.performance, config=state.config)


def _name(plan: Plan, target: int) -> str:
    return "" if target == NOWHERE else plan.names[target]


# --- the study ---


def _plan_in_force(state: MonitorState, late: bool) -> Plan:
    if state.study:
        return _plan(state.study)
    if not late:
        raise NotYet(("recorder",), CONFIG_WAIT_S)
    raise Unavailable(f"the monitor has not read the configuration of session {state.session} yet")


@lru_cache(maxsize=256)
def _plan(text: str) -> Plan:
    """The study of a ``config`` fact; cached, for it is the same from message to message."""
    study = study_of(json.loads(text), "config")
    names = study.aoi_names
    targets: dict[str | None, int] = {None: NOWHERE} | {name: i for i, name in enumerate(names)}
    longest_ns = round(study.attention.maximum_dwell_s * NS)
    return Plan(study, names, targets, tuple(map(area_of, study.aois)), rule_of(study.fixation), longest_ns)
