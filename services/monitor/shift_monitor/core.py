"""The monitor's core: the partner model as a fold, ``step(state, event, now) -> Step``. Pure.

It opens nothing and reads no clock: the stamp comes with the event, and gaze carries the time of its source's clock.
Each applied input but gaze publishes exactly one observation, as the last of its facts. An observation's ``seen`` names
the inputs that were applied, and each chunk of gaze is a fact of its own, so the order of the inputs follows from the
outputs, and a recording can be folded again.

The observation of a chunk may be held back (:func:`shift_monitor.published.is_due`). :class:`Show` publishes it: the
runtime steps it when somebody needs what is held back.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from shift_schemas.core_protocol import Step
from shift_schemas.errors import ShiftError, UnknownThing
from shift_schemas.lifecycle import accepts_input
from shift_schemas.messages import AoiPositions, Config, Decision, GazeChunk, Performance, Session
from shift_schemas.timestamps import Stamp

from shift_monitor.area_step import PositionsWithHistory, step_positions
from shift_monitor.attention import initial_attention
from shift_monitor.awareness import History, add_result, correct_result
from shift_monitor.capacity import Capacity, apply_strategy
from shift_monitor.clock_ledger import count_refused
from shift_monitor.gaze_columns import gaze_chunk_of
from shift_monitor.gaze_input import ChunkWithHistory
from shift_monitor.gaze_step import close_stream, step_gaze
from shift_monitor.prepared_study import prepare_study
from shift_monitor.published import clock_facts, fixation_fact, observation_of, publish
from shift_monitor.state import MOST_SOURCES, MonitorState, dump, initial, load, study_in_force, with_ledger

__all__ = [
    "MonitorState",
    "Show",
    "dump",
    "gaze_chunk_of",
    "held",
    "initial",
    "load",
    "observation_of",
    "refused",
    "step",
]


@dataclass(frozen=True)
class Show:
    """Somebody needs the observation that is held back."""


def held(state: MonitorState) -> Show | None:
    """Return the event that publishes what is held back, or None if nothing is."""
    return Show() if state.held and not state.ended else None


def step(state: MonitorState | None, event: object, now: Stamp, timed_out: bool = False) -> Step[MonitorState]:
    """Apply one message.

    Parameters
    ----------
    state
        None before the session's start.
    now
        The stamp of the facts.
    timed_out
        Whether the message no longer waits for what it needs to be applied.

    Raises
    ------
    UnknownThing
        There is no such session.
    InputsMissing
        The session's configuration has not come yet; ``Unavailable`` instead if ``timed_out`` is set.
    Conflict
        Gaze or moving AOIs for an ended session or from a source that was replaced.
    MalformedMessage
        Gaze on an AOI that the study does not have, such an AOI that moves, or gaze whose time does not rise.
    """
    if isinstance(event, Session):
        return _on_session(state, event, now)
    if state is None:
        raise UnknownThing("there is no such session here")
    match event:
        case Config():
            return publish(_on_config(state, event), now)
        case Decision():
            return publish(_on_decision(state, event, timed_out), now)
        case Performance():
            return publish(_on_performance(state, event, timed_out), now)
        case ChunkWithHistory():
            return step_gaze(state, event, now, timed_out)
        case GazeChunk():
            return step_gaze(state, ChunkWithHistory(event), now, timed_out)
        case PositionsWithHistory():
            return step_positions(state, event, now, timed_out)
        case AoiPositions():
            return step_positions(state, PositionsWithHistory(event), now, timed_out)
        case Show():
            return publish(state, now) if state.held else Step(state)
    return Step(state)


def _on_session(state: MonitorState | None, event: Session, now: Stamp) -> Step[MonitorState]:
    if state is None:
        return Step(initial(event))
    if accepts_input(event.state) or state.ended:
        return Step(state)
    if not state.study:
        return Step(replace(state, ended=True))
    after, ended = close_stream(replace(state, ended=True))
    fixations = tuple(fixation_fact(after, f, now) for f in ended)
    return publish(after, now, (*fixations, *clock_facts(after, now)))


def refused(state: MonitorState, message: object, error: ShiftError) -> MonitorState:
    """Return the state after a request that was refused: a refused chunk of gaze is counted, unless it came too late.

    What is counted reaches the recording with the ledger of its source, at the session's end.
    """
    chunk = message.chunk if isinstance(message, ChunkWithHistory) else message
    if not isinstance(chunk, GazeChunk) or state.ended or not state.study:
        return state
    if chunk.source not in state.ledgers and len(state.ledgers) >= MOST_SOURCES:
        return state
    return replace(state, ledgers=with_ledger(state, chunk.source, lambda ledger: count_refused(ledger, error.kind)))


def _on_config(state: MonitorState, event: Config) -> MonitorState:
    study = prepare_study(event.study).study
    state = replace(state, study=event.study, config=event.version)
    if state.attention.weights:
        return state
    return replace(state, capacity=Capacity(study.capacity.start), attention=initial_attention(len(study.aois)))


def _on_decision(state: MonitorState, event: Decision, timed_out: bool) -> MonitorState:
    settings = study_in_force(state, timed_out).study.capacity
    return replace(state, capacity=apply_strategy(state.capacity, event.strategy, settings), decision=event.n)


def _on_performance(state: MonitorState, event: Performance, timed_out: bool) -> MonitorState:
    study_in_force(state, timed_out)
    history = (correct_result if event.corrects else add_result)(state.awareness.get(event.task, History()), event)
    return replace(
        state,
        awareness={**state.awareness, event.task: history},
        performance=event.n,
        result_warnings=tuple(event.warnings),
    )
