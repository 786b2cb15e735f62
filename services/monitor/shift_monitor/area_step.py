"""One message of areas that moved, folded into the partner model. Pure.

It changes nothing that an observation shows: gaze is tested against the areas when it is applied.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any, NamedTuple

from shift_schemas.core_protocol import Step
from shift_schemas.errors import Conflict, FieldError, MalformedMessage, shorten
from shift_schemas.messages import AoiPosition, AoiPositions, Aois, Fact, GazeOutcome
from shift_schemas.suggestions import did_you_mean
from shift_schemas.timestamps import NS, Stamp
from shift_study.moving_areas import begun_again, moved, placed, position_of, track_of

from shift_monitor.chunk_sequence import advance, classify_arrival, sequence_from
from shift_monitor.gaze_stream import GazeStream, oldest_waiting_ns
from shift_monitor.prepared_study import PreparedStudy
from shift_monitor.published import aois_fact
from shift_monitor.state import MOST_SOURCES, AreaStream, MonitorState, study_in_force


class RecordedPositions(NamedTuple):
    """The record of one number of a source. Without ``positions`` its content is known to be different."""

    segment: int
    positions: AoiPositions | None = None
    warnings: tuple[str, ...] = ()


class PositionsWithHistory(NamedTuple):
    """A message, and the records of its source and number, oldest first."""

    positions: AoiPositions
    earlier: tuple[RecordedPositions, ...] = ()


def positions_of(fact: Aois) -> AoiPositions:
    """Return the message that a fact records; applying it again gives the same fact."""
    return AoiPositions(source=fact.source, seq=fact.seq, t=fact.t, aois=[position_of(aoi) for aoi in fact.aois])


def positions_input(positions: AoiPositions, recall: Callable[..., Iterable[Fact]]) -> PositionsWithHistory:
    """Return the message with everything that the monitor recorded under its number."""
    found = recall("aois", source=positions.source, seq=positions.seq)
    earlier = [
        RecordedPositions(fact.segment, positions_of(fact), tuple(fact.warnings))
        for fact in found
        if isinstance(fact, Aois)
    ]
    return PositionsWithHistory(positions, tuple(earlier))


def step_positions(state: MonitorState, given: PositionsWithHistory, now: Stamp, timed_out: bool) -> Step[MonitorState]:
    """Apply positions of areas, or answer repeated ones as before. The errors are those of ``core.step``."""
    positions = given.positions
    if state.ended:
        raise Conflict(f"session {state.session} has ended")
    prepared = study_in_force(state, timed_out)
    content = [placed(aoi) for aoi in positions.aois]
    for earlier in given.earlier:
        before = earlier.positions
        if before is not None and before.t == positions.t and [placed(a) for a in before.aois] == content:
            return Step(state, result=_result(state, positions, earlier.warnings), repeat=True)
    _check_source(state, positions)
    places = _places(positions, prepared)
    t_ns = round(positions.t * NS)
    stream = state.tracks.get(positions.source) or AreaStream(track_of(prepared.areas))
    stream, outcome = _onto(stream, given, t_ns)
    warnings = tuple(_warnings(state, positions, t_ns, outcome))
    if outcome == "applied":
        numbering = advance(stream.numbering or sequence_from(positions.seq), positions.seq)
        stream = stream._replace(track=moved(stream.track, t_ns, places), numbering=numbering)
    after = replace(state, tracks={**state.tracks, positions.source: stream})
    fact = aois_fact(after, positions, content, stream.segment, outcome, warnings, now)
    return Step(after, (fact,), _result(after, positions, warnings))


def _result(state: MonitorState, positions: AoiPositions, warnings: tuple[str, ...]) -> dict[str, Any]:
    result = {"accepted": len(positions.aois), "source": positions.source, "seq": positions.seq}
    return {**result, "warnings": list(warnings)} if warnings else result


def _check_source(state: MonitorState, positions: AoiPositions) -> None:
    if positions.source in state.former:
        current = state.stream.source if state.stream else ""
        raise Conflict(f"gaze source {positions.source} was replaced by {current}; its AOIs can have no effect")
    if positions.source not in state.tracks and len(state.tracks) >= MOST_SOURCES:
        raise Conflict(f"session {state.session} has moving AOIs of {MOST_SOURCES} gaze sources; it takes no more")


def _places(positions: AoiPositions, prepared: PreparedStudy) -> list[tuple[int, AoiPosition]]:
    """Return each position with its area's index. Raise :class:`MalformedMessage` for an AOI of another study."""
    for i, position in enumerate(positions.aois):
        if position.name not in prepared.names:
            meant = did_you_mean(position.name, prepared.names)
            rule = f"one of the study's AOIs: {', '.join(prepared.names)}{meant}"
            error = FieldError(field=f"aois.{i}.name", value=shorten(position.name), rule=rule)
            raise MalformedMessage(f"aois: {error.field}: {error.value}: {rule}", (error,))
    return [(prepared.names.index(position.name), position) for position in positions.aois]


def _onto(stream: AreaStream, given: PositionsWithHistory, t_ns: int) -> tuple[AreaStream, GazeOutcome]:
    """Return the stream that a message is applied to, and whether it is applied.

    The time that goes back begins a segment of the source's clock, and a number that comes again one of the numbering.
    """
    seq, numbering, last_ns = given.positions.seq, stream.numbering, stream.track.last_ns
    goes_on = last_ns is None or t_ns >= last_ns
    if numbering is None:
        return stream, "applied"
    used = any(earlier.segment == stream.segment for earlier in given.earlier)
    arrival = classify_arrival(numbering, seq, used, goes_on)
    if arrival == "late":
        return stream, "late"
    if arrival == "new":
        return stream, "applied"
    if not goes_on:
        stream = stream._replace(track=begun_again(stream.track), clock_segment=stream.clock_segment + 1)
    kept = numbering if seq > numbering.last else None
    return stream._replace(segment=stream.segment + 1, numbering=kept), "applied"


def _warnings(state: MonitorState, positions: AoiPositions, t_ns: int, outcome: GazeOutcome) -> list[str]:
    stream, source = state.stream, positions.source
    if outcome == "late":
        return [f"AOIs {positions.seq} of {source} come after later ones: they are recorded and not applied"]
    if stream is None:
        return []
    if stream.source != source:
        return [f"gaze comes from {stream.source}: the AOIs of {source} have no effect until gaze comes from {source}"]
    if stream.named is not None:
        return [f"gaze source {source} sends AOI names: where an AOI is has no effect on them"]
    return _warning_of_late_areas(stream, positions, t_ns)


def _warning_of_late_areas(stream: GazeStream, positions: AoiPositions, t_ns: int) -> list[str]:
    tested_ns = oldest_waiting_ns(stream)
    if tested_ns is None or t_ns >= tested_ns:
        return []
    late = f"these AOIs hold from {positions.t:g} s on, and gaze before {tested_ns / NS:g} s was tested already"
    return [f"{late}, against the former AOIs; send AOIs before the gaze of their time"]
