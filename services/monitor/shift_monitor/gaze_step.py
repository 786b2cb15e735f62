"""One chunk of gaze, folded into the partner model. Pure.

A chunk is a repeat, late, new, the first one of another source, or the first one of another segment of its source.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

from shift_schemas.core_protocol import Step
from shift_schemas.errors import Conflict
from shift_schemas.messages import Fact, GazeChunk
from shift_schemas.timestamps import NS, Stamp
from shift_study.moving_areas import begun_again, forgotten_before

from shift_monitor.attention import forget_run
from shift_monitor.chunk_sequence import (
    Arrival,
    ChunkSequence,
    advance,
    classify_arrival,
    missing_chunks,
    sequence_from,
)
from shift_monitor.clock_ledger import count_applied, count_late, count_repeated, jumps_forward, mark_recorded
from shift_monitor.fixation import finish
from shift_monitor.gaze_account import end_segment
from shift_monitor.gaze_checks import check_rise, check_samples
from shift_monitor.gaze_input import ChunkWithHistory, find_repeated
from shift_monitor.gaze_stream import (
    IDLE,
    GazeStream,
    apply_fixation_dwell,
    apply_names,
    apply_points,
    oldest_needed_ns,
)
from shift_monitor.gaze_warnings import (
    clock_jump_warning,
    clock_restart_warning,
    jump_warnings,
    late_warning,
    next_spacings,
    number_restart_warning,
    rate_warnings,
    share_warnings,
)
from shift_monitor.prepared_study import PreparedStudy, prepare_study
from shift_monitor.published import (
    SourcedFixation,
    fixation_fact,
    gaze_fact,
    gaze_result,
    is_due,
    publish,
    running_clock_facts,
)
from shift_monitor.state import MOST_SOURCES, AreaStream, MonitorState, areas_over_time, study_in_force, with_ledger

LARGEST_COUNT = 2**53
"""The largest count in a message (shift_schemas.messages)."""


class Continuation(NamedTuple):
    """The state and the stream that a chunk is applied to."""

    state: MonitorState
    stream: GazeStream
    ended: list[SourcedFixation]
    """The fixations that ended before the chunk."""
    warnings: list[str]
    restarted: bool = False
    """Whether the chunk begins another segment of its source."""


def step_gaze(state: MonitorState, gaze: ChunkWithHistory, now: Stamp, timed_out: bool) -> Step[MonitorState]:
    """Apply one chunk of gaze, or answer a repeated one as before.

    ``timed_out`` says that the chunk no longer waits for the session's configuration. The errors are those of
    ``shift_monitor.core.step``.
    """
    chunk = gaze.chunk
    if state.ended:
        raise Conflict(f"session {state.session} has ended")
    prepared = study_in_force(state, timed_out)
    if (first := find_repeated(gaze)) is not None:
        shown_in = state.version + state.held
        after = replace(state, ledgers=with_ledger(state, chunk.source, count_repeated))
        return Step(after, result=gaze_result(chunk, first.accepted, shown_in, first.warnings), repeat=True)
    _check_source(state, chunk)
    check_samples(chunk, prepared)
    times = [round(t * NS) for t in chunk.t]
    check_rise(None, times, chunk)
    stream = state.stream
    if stream is None or stream.source != chunk.source:
        return _apply_chunk(_switch_source(state, chunk), chunk, times, now)
    match _arrival(state, stream, gaze, times, now):
        case "late":
            return _record_late(state, stream, chunk, now)
        case "restart":
            return _apply_chunk(_begin_segment(state, stream, chunk, times), chunk, times, now)
        case "new":
            check_rise(stream.last_ns, times, chunk)
            return _apply_chunk(_continue_stream(state, stream, chunk), chunk, times, now)


def close_stream(state: MonitorState) -> tuple[MonitorState, list[SourcedFixation]]:
    """Return the state when no more gaze comes from its source, and the open fixation, which ends."""
    if state.stream is None:
        return state, []
    prepared, stream = prepare_study(state.study), state.stream
    output = finish(stream.detector, prepared.rule)
    areas = areas_over_time(state, stream.source, prepared)
    attention, account = apply_fixation_dwell(state.attention, stream.account, output, prepared, areas)
    after = replace(
        state,
        attention=forget_run(attention),
        stream=replace(stream, named=None, detector=IDLE, account=account),
        fixations=state.fixations + len(output.found),
    )
    return after, [SourcedFixation(stream.source, stream.segment, f, areas) for f in output.found]


# --- which stream a chunk belongs to ---


def _check_source(state: MonitorState, chunk: GazeChunk) -> None:
    if chunk.source in state.former:
        current = state.stream.source if state.stream else ""
        raise Conflict(f"gaze source {chunk.source} was replaced by {current}; begin again under another name")
    if len(state.former) >= MOST_SOURCES and state.stream and state.stream.source != chunk.source:
        raise Conflict(f"session {state.session} had {MOST_SOURCES} gaze sources replaced; it takes no more")


def _arrival(state: MonitorState, stream: GazeStream, gaze: ChunkWithHistory, times: list[int], now: Stamp) -> Arrival:
    seq, last_ns = gaze.chunk.seq, stream.last_ns
    used = any(e.segment == stream.segment for e in gaze.earlier)
    continues = last_ns is None or times[0] >= last_ns
    if state.format == 1 and seq <= stream.numbering.last and not used:
        return "late"  # format 1 does not look at the chunk's time
    arrival = classify_arrival(stream.numbering, seq, used, continues)
    ledger = state.ledgers.get(stream.source)
    if arrival == "new" and state.format >= 6 and ledger is not None and jumps_forward(ledger, times, now):
        return "restart"
    return arrival


def _switch_source(state: MonitorState, chunk: GazeChunk) -> Continuation:
    """Replace the source in use by the chunk's source."""
    state, ended = close_stream(state)
    if (former := state.stream) is not None:
        state = replace(state, former={**state.former, former.source: former.numbering.last})
    return Continuation(state, GazeStream(chunk.source), ended, [])


def _begin_segment(state: MonitorState, stream: GazeStream, chunk: GazeChunk, times: list[int]) -> Continuation:
    """Begin another segment of a source that restarted its clock or its numbering; nothing is carried over."""
    state, ended = close_stream(state)
    sequence, segment = stream.numbering, stream.segment + 1
    if chunk.seq > sequence.last:
        assert stream.last_ns is not None
        changed = clock_jump_warning if times[0] > stream.last_ns else clock_restart_warning
        warning = changed(chunk.source, stream.last_ns, times[0], segment)
        sequence = ChunkSequence(sequence.last, chunk.seq)
    else:
        warning = number_restart_warning(chunk.source, sequence.last, chunk.seq, segment)
        sequence = sequence_from(chunk.seq)
    after = replace(state, restarts=state.restarts + 1, tracks=_tracks_in(state, stream.source, segment))
    begun = GazeStream(stream.source, sequence, segment=segment, account=end_segment(stream.account))
    return Continuation(after, begun, ended, [warning], restarted=True)


def _tracks_in(state: MonitorState, source: str, segment: int) -> dict[str, AreaStream]:
    """Return the moving areas where a segment begins. Areas that are on its clock already stay as they are."""
    moving = state.tracks.get(source)
    if moving is None:
        return state.tracks
    track = moving.track if moving.clock_segment >= segment else begun_again(moving.track)
    return {**state.tracks, source: moving._replace(track=track, clock_segment=segment)}


def _without_old_areas(state: MonitorState, stream: GazeStream) -> MonitorState:
    """Return the state without the places of moving areas that no later sample is tested against."""
    moving, needed_ns = state.tracks.get(stream.source), oldest_needed_ns(stream)
    if moving is None or needed_ns is None:
        return state
    kept = moving._replace(track=forgotten_before(moving.track, needed_ns))
    return replace(state, tracks={**state.tracks, stream.source: kept})


def _continue_stream(state: MonitorState, stream: GazeStream, chunk: GazeChunk) -> Continuation:
    """Continue a source; where it changes between points and AOI names, its open fixation ends."""
    if stream.last_ns is not None and (chunk.aoi is None) == (stream.named is None):
        return Continuation(state, stream, [], [])
    state, ended = close_stream(state)
    account = end_segment(state.stream.account if state.stream else stream.account)
    fresh = GazeStream(stream.source, stream.numbering, segment=stream.segment, account=account)
    return Continuation(state, fresh, ended, [])


# --- what a chunk does ---


def _record_late(state: MonitorState, stream: GazeStream, chunk: GazeChunk, now: Stamp) -> Step[MonitorState]:
    """Record a late chunk, which changes nothing of the model."""
    warnings = _recorded_warnings(state, [late_warning(chunk.seq, stream.numbering.last)])
    after = replace(state, gaze_warnings=warnings, ledgers=with_ledger(state, chunk.source, count_late))
    facts = (gaze_fact(after, chunk, now, "late"),)
    return publish(after, now, facts, gaze_result(chunk, 0, after.version + 1, warnings))


def _apply_chunk(onto: Continuation, chunk: GazeChunk, times: list[int], now: Stamp) -> Step[MonitorState]:
    """Apply a chunk to its stream; publish the chunk, the fixations that ended and the observation."""
    state, stream = onto.state, onto.stream
    prepared = prepare_study(state.study)
    missing = missing_chunks(stream.numbering, chunk.seq)
    dropped = min(state.dropped + missing, LARGEST_COUNT)
    ledgers = with_ledger(
        state,
        chunk.source,
        lambda ledger: count_applied(ledger, chunk, times, missing, onto.restarted, now, by_second=state.format >= 6),
    )
    jumps = jump_warnings(stream.last_ns, times[0])
    spacings = next_spacings(stream.spacings, stream.last_ns, times)
    stream = replace(stream, numbering=advance(stream.numbering, chunk.seq), spacings=spacings)
    areas = areas_over_time(state, chunk.source, prepared)
    if chunk.aoi is None:
        stream, attention, found = apply_points(stream, state.attention, times, chunk, prepared, areas)
    else:
        stream, attention, found = *apply_names(stream, state.attention, times, chunk.aoi, prepared), []
    quality = _quality_warnings(stream, chunk.aoi is None, prepared)
    warnings = _recorded_warnings(state, [*onto.warnings, *jumps, *quality])
    after = replace(
        state, stream=stream, attention=attention, dropped=dropped, fixations=state.fixations + len(found),
        samples=state.samples + len(times), received=now, gaze_warnings=warnings, held=True, ledgers=ledgers,
    )  # fmt: skip
    ended = [*onto.ended, *(SourcedFixation(chunk.source, stream.segment, f, areas) for f in found)]
    facts: tuple[Fact, ...] = (gaze_fact(after, chunk, now, "applied"), *(fixation_fact(after, f, now) for f in ended))
    after = _without_old_areas(after, stream)
    if clocks := running_clock_facts(after, chunk.source, onto.restarted, now):
        facts = (*facts, *clocks)
        after = replace(after, ledgers=with_ledger(after, chunk.source, lambda ledger: mark_recorded(ledger, now)))
    result = gaze_result(chunk, len(times), after.version + 1, warnings)
    return publish(after, now, facts, result) if is_due(after) else Step(after, facts, result)


def _quality_warnings(stream: GazeStream, points: bool, prepared: PreparedStudy) -> list[str]:
    gap_ns = prepared.rule.gap_ns
    rate = rate_warnings(stream.spacings, points, gap_ns)
    return rate + share_warnings(stream.account, points, gap_ns if points else prepared.longest_ns)


def _recorded_warnings(state: MonitorState, warnings: list[str]) -> tuple[str, ...]:
    """Return the warnings as the session records them; a session of format 1 records none."""
    return tuple(warnings) if state.format > 1 else ()
