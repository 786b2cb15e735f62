"""The monitor's core: the partner model as a fold, ``step(state, event, now) -> Step``. Pure.

It opens nothing and reads no clock: the stamp comes with the event, gaze brings its source's clock along.
Each input that is applied puts out exactly one observation, as the last of its facts, whose ``seen`` says
what was applied; so the order of the inputs can be read from the outputs, and a recording be folded again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from pydantic import TypeAdapter
from shift_schemas.core_protocol import InputsMissing, Step
from shift_schemas.errors import Conflict, Unavailable, UnknownThing
from shift_schemas.lifecycle import accepts_input
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
from shift_schemas.timestamps import NS, Stamp

from shift_monitor.areas import area_at
from shift_monitor.attention import Attention, fresh, gaze_class, interrupted
from shift_monitor.awareness import History, awareness_views, corrected, reported
from shift_monitor.capacity import Capacity, capacity_class, executed
from shift_monitor.chunk_sequence import Arrival, Numbering, arrival, began_anew, read, skipped
from shift_monitor.fixation import Found, ended
from shift_monitor.gaze_account import broken_off, shares
from shift_monitor.gaze_input import GazeInput, is_repeat
from shift_monitor.gaze_stream import (
    IDLE,
    NO_TIME,
    Stream,
    check_rise,
    check_samples,
    dwelt_on,
    names_applied,
    points_applied,
    recorded_columns,
)
from shift_monitor.gaze_warnings import (
    clock_restart_warning,
    jump_warnings,
    late_warning,
    next_spacings,
    number_restart_warning,
    rate_warnings,
    share_warnings,
)
from shift_monitor.prepared_study import Plan, name_of, plan_of

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
    restarts: int = 0
    samples: int = 0
    received: Stamp | None = None
    """When the last applied sample came."""
    format: int = 1
    """What the session records (``shift_schemas.messages.FORMAT``)."""
    gaze_warnings: tuple[str, ...] = ()
    result_warnings: tuple[str, ...] = ()
    decision: int = 0
    performance: int = 0
    config: int = 0


_STATE = TypeAdapter(MonitorState)


def initial(event: Session) -> MonitorState:
    """The state at the start of a session, before its configuration."""
    return MonitorState(event.session, format=event.format)


def dump(state: MonitorState) -> str:
    """The state as JSON; floats keep every digit."""
    return _STATE.dump_json(state).decode()


def load(text: str) -> MonitorState:
    """The state that :func:`dump` wrote."""
    return _STATE.validate_json(text)


def step(state: MonitorState | None, event: object, now: Stamp, timed_out: bool = False) -> Step[MonitorState]:
    """Apply one message.

    Parameters
    ----------
    state
        None before the session's start.
    now
        The facts' stamp.
    timed_out
        No more waiting for what the message needs to be applied.

    Raises
    ------
    UnknownThing
        There is no such session.
    InputsMissing
        The session's configuration has not come yet; ``Unavailable`` instead where it ``timed_out``.
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
            return _observed(_decided(state, event, timed_out), now)
        case Performance():
            return _observed(_performed(state, event, timed_out), now)
        case GazeInput():
            return _gaze(state, event, now, timed_out)
        case GazeChunk():
            return _gaze(state, GazeInput(event), now, timed_out)
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
            **(_quality(state, now) if state.format > 1 else {}),
        ),
        awareness=awareness_views(state.awareness, study.awareness),
        warnings=[*state.gaze_warnings, *state.result_warnings],
    )


def _quality(state: MonitorState, now: Stamp) -> dict[str, Any]:
    """How good gaze is: what a session of format 1 did not record."""
    share = shares(state.stream.account if state.stream else NO_TIME)
    received = state.received
    return {
        "restarts": state.restarts, "samples": state.samples, "dwell_s": state.attention.dwell_ns / NS,
        "lost": share.lost, "unclassified": share.unclassified, "off_aoi": share.off_aoi,
        "off_stimulus": share.off_stimulus, "received": received,
        "age_s": None if received is None else max(now.ns - received.ns, 0) / NS,
    }  # fmt: skip


# --- everything but gaze ---


def _session(state: MonitorState | None, event: Session, now: Stamp) -> Step[MonitorState]:
    if state is None:
        return Step(initial(event))
    if accepts_input(event.state) or state.ended:
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


def _decided(state: MonitorState, event: Decision, timed_out: bool) -> MonitorState:
    settings = _plan_in_force(state, timed_out).study.capacity
    return replace(state, capacity=executed(state.capacity, event.strategy, settings), decision=event.n)


def _performed(state: MonitorState, event: Performance, timed_out: bool) -> MonitorState:
    _plan_in_force(state, timed_out)
    history = (corrected if event.corrects else reported)(state.awareness.get(event.task, History()), event)
    return replace(
        state,
        awareness={**state.awareness, event.task: history},
        performance=event.n,
        result_warnings=tuple(event.warnings),
    )


# --- gaze ---


def _gaze(state: MonitorState, given: GazeInput, now: Stamp, timed_out: bool) -> Step[MonitorState]:
    chunk = given.chunk
    if state.ended:
        raise Conflict(f"session {state.session} has ended")
    plan = _plan_in_force(state, timed_out)
    if (first := is_repeat(given)) is not None:
        result = _result(state, chunk, first.accepted, first.warnings)
        return Step(state, result={**result, "observation": state.version}, repeat=True)
    _check_source(state, chunk)
    check_samples(chunk, plan)
    times = [round(t * NS) for t in chunk.t]
    check_rise(None, times, chunk)
    stream = state.stream
    if stream is None or stream.source != chunk.source:
        return _observed_gaze(*_taken_over(state, chunk), chunk, times, now)
    match _arrival(state, stream, given, times):
        case "late":
            return _late(state, stream, chunk, now)
        case "restart":
            return _observed_gaze(*_restarted(state, stream, chunk, times), chunk, times, now)
        case "new":
            check_rise(stream.last_ns, times, chunk)
            return _observed_gaze(*_gone_on(state, stream, chunk), chunk, times, now)


def _arrival(state: MonitorState, stream: Stream, given: GazeInput, times: list[int]) -> Arrival:
    seq, last_ns = given.chunk.seq, stream.last_ns
    used = any(e.segment == stream.segment for e in given.earlier)
    goes_on = last_ns is None or times[0] >= last_ns
    if state.format == 1 and seq <= stream.numbering.last and not used:
        return "late"  # as it was then: whatever its time says
    return arrival(stream.numbering, seq, used, goes_on)


def _late(state: MonitorState, stream: Stream, chunk: GazeChunk, now: Stamp) -> Step[MonitorState]:
    """Record a late chunk: it changes nothing of the model."""
    warnings = _told(state, [late_warning(chunk.seq, stream.numbering.last)])
    after = replace(state, gaze_warnings=warnings)
    facts = (_gaze_fact(after, chunk, now, "late"),)
    return _observed(after, now, facts, _result(after, chunk, 0, warnings))


Ending = list[tuple[str, int, Found]]
"""Fixations that ended, each with its source and segment."""


def _taken_over(state: MonitorState, chunk: GazeChunk) -> tuple[MonitorState, Stream, Ending, list[str]]:
    """Another source begins to speak."""
    state, ending = _silenced(state)
    if (former := state.stream) is not None:
        state = replace(state, former={**state.former, former.source: former.numbering.last})
    return state, Stream(chunk.source), ending, []


def _restarted(
    state: MonitorState, stream: Stream, chunk: GazeChunk, times: list[int]
) -> tuple[MonitorState, Stream, Ending, list[str]]:
    """The source began its clock or its numbering anew: another segment of it, to which nothing is carried over."""
    state, ending = _silenced(state)
    numbering, segment = stream.numbering, stream.segment + 1
    if chunk.seq > numbering.last:
        assert stream.last_ns is not None
        warning = clock_restart_warning(chunk.source, stream.last_ns, times[0], segment)
        numbering = Numbering(numbering.last, chunk.seq)
    else:
        warning = number_restart_warning(chunk.source, numbering.last, chunk.seq, segment)
        numbering = began_anew(chunk.seq)
    after = replace(state, restarts=state.restarts + 1)
    return (
        after,
        Stream(stream.source, numbering, segment=segment, account=broken_off(stream.account)),
        ending,
        [warning],
    )


def _gone_on(state: MonitorState, stream: Stream, chunk: GazeChunk) -> tuple[MonitorState, Stream, Ending, list[str]]:
    """The source goes on, perhaps with another kind of gaze."""
    if stream.last_ns is None or (chunk.aoi is None) != (stream.named is None):
        state, ending = _silenced(state)
        account = broken_off(state.stream.account if state.stream else stream.account)
        return state, Stream(stream.source, stream.numbering, segment=stream.segment, account=account), ending, []
    return state, stream, [], []


def _observed_gaze(
    state: MonitorState, stream: Stream, ending: Ending, warnings: list[str], chunk: GazeChunk, times: list[int],
    now: Stamp,
) -> Step[MonitorState]:  # fmt: skip
    """Apply a chunk to its stream, and put out what it was, what ended with it and what is observed."""
    plan = plan_of(state.study)
    dropped = min(state.dropped + skipped(stream.numbering, chunk.seq), LARGEST_COUNT)
    warnings += jump_warnings(stream.last_ns, times[0])
    spacings = next_spacings(stream.spacings, stream.last_ns, times)
    stream = replace(stream, numbering=read(stream.numbering, chunk.seq), spacings=spacings)
    if chunk.aoi is None:
        stream, attention, found = points_applied(stream, state.attention, times, chunk, plan)
    else:
        stream, attention, found = *names_applied(stream, state.attention, times, chunk.aoi, plan), []
    warnings += rate_warnings(spacings, chunk.aoi is None, plan.rule.gap_ns) + share_warnings(
        stream.account, chunk.aoi is None, plan.rule.gap_ns if chunk.aoi is None else plan.longest_ns
    )
    told = _told(state, warnings)
    after = replace(
        state, stream=stream, attention=attention, dropped=dropped, fixations=state.fixations + len(found),
        samples=state.samples + len(times), received=now, gaze_warnings=told,
    )  # fmt: skip
    ended = [*ending, *((chunk.source, stream.segment, f) for f in found)]
    facts = (_gaze_fact(after, chunk, now, "applied"), *(_fixation(after, f, now) for f in ended))
    return _observed(after, now, facts, _result(after, chunk, len(times), told))


def _told(state: MonitorState, warnings: list[str]) -> tuple[str, ...]:
    """A session of format 1 records no warnings."""
    return tuple(warnings) if state.format > 1 else ()


def _result(state: MonitorState, chunk: GazeChunk, accepted: int, warnings: Sequence[str]) -> dict[str, Any]:
    result: dict[str, Any] = {
        "accepted": accepted, "source": chunk.source, "seq": chunk.seq, "observation": state.version + 1,
    }  # fmt: skip
    return {**result, "warnings": list(warnings)} if warnings else result


def _silenced(state: MonitorState) -> tuple[MonitorState, Ending]:
    """The state when no more gaze comes from its source: an open fixation ends."""
    if state.stream is None:
        return state, []
    plan, stream = plan_of(state.study), state.stream
    output = ended(stream.detector, plan.rule)
    attention, account = dwelt_on(state.attention, stream.account, output, plan)
    after = replace(
        state,
        attention=interrupted(attention),
        stream=replace(stream, named=None, detector=IDLE, account=account),
        fixations=state.fixations + len(output.found),
    )
    return after, [(stream.source, stream.segment, f) for f in output.found]


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
    return Gaze(
        session=state.session, stamp=now, seen=_seen(state), source=chunk.source, seq=chunk.seq,
        segment=state.stream.segment if state.stream else 0, outcome=outcome, t=chunk.t, **recorded_columns(chunk),
        warnings=list(state.gaze_warnings),
    )  # fmt: skip


def _fixation(state: MonitorState, found: tuple[str, int, Found], now: Stamp) -> Fixation:
    source, segment, (start_ns, end_ns, x, y) = found
    plan = plan_of(state.study)
    return Fixation(
        session=state.session, stamp=now, seen=_seen(state), source=source, segment=segment, start_s=start_ns / NS,
        duration_s=(end_ns - start_ns) / NS, x=x, y=y, aoi=name_of(plan, area_at(plan.areas, x, y)),
    )  # fmt: skip


def _seen(state: MonitorState) -> Seen:
    gaze = dict(state.former)
    if state.stream is not None:
        gaze[state.stream.source] = state.stream.numbering.last
    return Seen(gaze=gaze, decision=state.decision, performance=state.performance, config=state.config)


# --- the study ---


def _plan_in_force(state: MonitorState, timed_out: bool) -> Plan:
    if state.study:
        return plan_of(state.study)
    if not timed_out:
        raise InputsMissing(("recorder",), CONFIG_WAIT_S)
    raise Unavailable(f"the monitor has not read the configuration of session {state.session} yet")
