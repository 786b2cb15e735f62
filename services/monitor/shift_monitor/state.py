"""The state of the monitor: the partner model of one session, and its JSON form. Pure."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

from pydantic import TypeAdapter
from shift_model.vocabulary import GazeClass
from shift_schemas.core_protocol import InputsMissing
from shift_schemas.errors import Unavailable
from shift_schemas.messages import AoiPositions, GazeChunk, Session
from shift_schemas.timestamps import Stamp
from shift_study.moving_areas import AreasOverTime, AreaTrack

from shift_monitor.attention import Attention
from shift_monitor.awareness import History
from shift_monitor.capacity import Capacity
from shift_monitor.chunk_sequence import ChunkSequence
from shift_monitor.clock_ledger import EMPTY_LEDGER, ClockLedger
from shift_monitor.gaze_stream import GazeStream
from shift_monitor.prepared_study import PreparedStudy, prepare_study

CONFIG_WAIT_S = 0.2
"""How long a message waits for the session's configuration, s (docs/design.md)."""

MOST_SOURCES = 256
"""Chosen: the most gaze sources of one session; each is remembered, so that a former one can be refused."""

UNSET_CAPACITY, UNSET_ATTENTION = Capacity(0.0), Attention(())
"""The values before the first configuration, which sets the start values."""


class Shown(NamedTuple):
    """What the last observation showed of gaze; the next one follows where this changes, or after a while."""

    category: GazeClass
    warnings: tuple[str, ...]
    source: str
    last_ns: int | None
    """The time of the source's last sample."""


class AreaStream(NamedTuple):
    """The areas that one source moves, and the numbers of its messages."""

    track: AreaTrack
    numbering: ChunkSequence | None = None
    """The numbers of this segment; None before its first message."""
    segment: int = 0
    """How often the time or the numbering began anew."""
    clock_segment: int = 0
    """The segment of the gaze source whose clock the times are on."""


@dataclass(frozen=True, slots=True)
class MonitorState:
    """The partner model of one session. ``load(dump(state)) == state``."""

    session: str
    study: str = ""
    """The study in force as ``config`` carries it; empty before the first configuration."""
    ended: bool = False
    version: int = 0
    capacity: Capacity = UNSET_CAPACITY
    attention: Attention = UNSET_ATTENTION
    awareness: dict[str, History] = field(default_factory=dict)
    stream: GazeStream | None = None
    former: dict[str, int] = field(default_factory=dict)
    """The sources that were replaced, each with the number of its last chunk."""
    fixations: int = 0
    dropped: int = 0
    restarts: int = 0
    samples: int = 0
    received: Stamp | None = None
    """When the last applied sample was received."""
    format: int = 1
    """The format of the session's recording (``shift_schemas.messages.FORMAT``)."""
    gaze_warnings: tuple[str, ...] = ()
    result_warnings: tuple[str, ...] = ()
    decision: int = 0
    performance: int = 0
    config: int = 0
    shown: Shown | None = None
    """What the last observation showed of gaze; None before the first one."""
    held: bool = False
    """Whether gaze was applied that no observation shows yet."""
    tracks: dict[str, AreaStream] = field(default_factory=dict)
    """The moving areas of each source that sends any."""
    ledgers: dict[str, ClockLedger] = field(default_factory=dict)
    """The ledger of each source; a session before format 5 keeps none."""

    @property
    def keeps_ledgers(self) -> bool:
        """Whether the session records the ledgers of its sources: from format 5 on."""
        return self.format >= 5


_STATE = TypeAdapter(MonitorState)


def initial(event: Session) -> MonitorState:
    """Return the state at the start of a session, before its configuration."""
    return MonitorState(event.session, format=event.format)


def with_ledger(
    state: MonitorState, source: str, change: Callable[[ClockLedger], ClockLedger]
) -> dict[str, ClockLedger]:
    """Return the ledgers with one of them changed, if the session keeps any."""
    if not state.keeps_ledgers:
        return state.ledgers
    return {**state.ledgers, source: change(state.ledgers.get(source, EMPTY_LEDGER))}


def areas_over_time(state: MonitorState, source: str, prepared: PreparedStudy) -> AreasOverTime:
    """Return the areas that gaze of a source is tested against."""
    track = state.tracks.get(source)
    return AreasOverTime(prepared.areas) if track is None else track.track.areas


def dump(state: MonitorState) -> str:
    """Return the state as JSON; floats keep every digit."""
    return _STATE.dump_json(state).decode()


def load(text: str) -> MonitorState:
    """Return the state that :func:`dump` wrote."""
    return _STATE.validate_json(text)


def may_be_used(state: MonitorState | None, chunk: GazeChunk) -> bool:
    """Return whether something may be recorded under a chunk's number; without it nothing has to be looked up.

    In the first segment of a source every recorded number is at most the last one.
    """
    if state is None:
        return False
    stream = state.stream
    if stream is None or stream.source != chunk.source:
        return chunk.source in state.former
    return stream.segment > 0 or chunk.seq <= stream.numbering.last


def may_be_moved_again(state: MonitorState | None, positions: AoiPositions) -> bool:
    """Return whether a message of moving areas may be recorded under its number already."""
    track = state.tracks.get(positions.source) if state is not None else None
    if track is None:
        return False
    return track.segment > 0 or (track.numbering is not None and positions.seq <= track.numbering.last)


def study_in_force(state: MonitorState, timed_out: bool) -> PreparedStudy:
    """Return the session's prepared study.

    Raises
    ------
    InputsMissing
        The session's configuration has not come yet.
    Unavailable
        The same, but ``timed_out`` is set: there is no more waiting.
    """
    if state.study:
        return prepare_study(state.study)
    if not timed_out:
        raise InputsMissing(("recorder",), CONFIG_WAIT_S)
    raise Unavailable(f"the monitor has not read the configuration of session {state.session} yet")
