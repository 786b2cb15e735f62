"""The facts that the monitor publishes: observations, recorded gaze and fixations. Pure."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

from shift_model.capacity import capacity_class
from shift_schemas.core_protocol import Step
from shift_schemas.messages import (
    AoiPositions,
    Aois,
    CapacityView,
    Clock,
    Fact,
    Fixation,
    Gaze,
    GazeChunk,
    GazeOutcome,
    GazeView,
    Observation,
    PlacedAoi,
    Seen,
)
from shift_schemas.timestamps import NS, Stamp
from shift_study.area_geometry import area_at, areas_at
from shift_study.moving_areas import AreasOverTime

from shift_monitor import clock_ledger
from shift_monitor.attention import gaze_class
from shift_monitor.awareness import awareness_views
from shift_monitor.clock_ledger import ClockLedger, clock_fact
from shift_monitor.fixation import EndedFixation
from shift_monitor.gaze_account import EMPTY_ACCOUNT, shares
from shift_monitor.gaze_columns import recorded_columns
from shift_monitor.prepared_study import name_of, prepare_study
from shift_monitor.recent_samples import valid_share
from shift_monitor.state import MonitorState, Shown


class SourcedFixation(NamedTuple):
    """A fixation that ended."""

    source: str
    segment: int
    fixation: EndedFixation
    areas: AreasOverTime
    """The areas of its source."""


SHOW_AFTER_NS = 250_000_000
"""Chosen: gaze that changes neither its class nor its warnings is shown after this much time of its source, which is
shorter than a glance and a third of the observations at 120 Hz."""


def publish(
    state: MonitorState, now: Stamp, facts: tuple[Fact, ...] = (), result: dict[str, Any] | None = None
) -> Step[MonitorState]:
    """Return a step that publishes these facts and, as the last one, the next observation."""
    shown = shown_of(state) if state.study else None
    after = replace(state, version=state.version + 1, shown=shown, held=False)
    return Step(after, (*facts, observation_of(after, now)), result or {})


def shown_of(state: MonitorState) -> Shown:
    """Return what an observation of this state shows of gaze."""
    category = gaze_class(state.attention, prepare_study(state.study).study.attention)
    stream = state.stream
    source, last_ns = (stream.source, stream.last_ns) if stream is not None else ("", None)
    return Shown(category, state.gaze_warnings, source, last_ns)


def is_due(state: MonitorState) -> bool:
    """Return whether an observation follows the chunk that was applied last.

    It does where the class of gaze, its warnings or its source change, and every :data:`SHOW_AFTER_NS` of the source's
    time. Before format 4 it follows every chunk.
    """
    before = state.shown
    if before is None or state.format < 4:
        return True
    found = shown_of(state)
    if before[:3] != found[:3] or before.last_ns is None or found.last_ns is None:
        return True
    return not 0 <= found.last_ns - before.last_ns < SHOW_AFTER_NS


def observation_of(state: MonitorState, now: Stamp) -> Observation:
    """Return the observation of the whole partner model."""
    prepared = prepare_study(state.study)
    study, attention = prepared.study, state.attention
    return Observation(
        session=state.session,
        stamp=now,
        seen=_seen(state),
        version=state.version,
        capacity=CapacityView(
            value=state.capacity.value, category=capacity_class(state.capacity.value, study.capacity.threshold)
        ),
        gaze=GazeView(
            category=gaze_class(attention, study.attention),
            weights=dict(zip(prepared.names, attention.weights, strict=True)),
            focus_shift=attention.focus_shift,
            aoi=name_of(prepared, attention.held),
            fixations=state.fixations,
            dropped=state.dropped,
            **(_gaze_quality(state, now) if state.format > 1 else {}),
            valid=valid_share(state.stream.recent) if state.format >= 6 and state.stream is not None else None,
        ),
        awareness=awareness_views(state.awareness, study.awareness),
        warnings=[*state.gaze_warnings, *state.result_warnings],
    )


def gaze_fact(state: MonitorState, chunk: GazeChunk, now: Stamp, outcome: GazeOutcome) -> Gaze:
    """Return the record of a chunk."""
    return Gaze(
        session=state.session, stamp=now, seen=_seen(state), source=chunk.source, seq=chunk.seq,
        segment=state.stream.segment if state.stream else 0, outcome=outcome, t=chunk.t, **recorded_columns(chunk),
        round_trip_s=chunk.round_trip_s, offset_s=chunk.offset_s,
        warnings=list(state.gaze_warnings),
    )  # fmt: skip


def fixation_fact(state: MonitorState, ended: SourcedFixation, now: Stamp) -> Fixation:
    """Return the record of a fixation that ended. Its AOIs are those at its mean position in the middle of its time."""
    source, segment, (start_ns, end_ns, x, y), over_time = ended
    prepared = prepare_study(state.study)
    areas = over_time.at((start_ns + end_ns) // 2)
    return Fixation(
        session=state.session, stamp=now, seen=_seen(state), source=source, segment=segment, start_s=start_ns / NS,
        duration_s=(end_ns - start_ns) / NS, x=x, y=y, aoi=name_of(prepared, area_at(areas, x, y)),
        aois=[prepared.names[i] for i in areas_at(areas, x, y)] if state.format >= 6 else None,
    )  # fmt: skip


def aois_fact(
    state: MonitorState, positions: AoiPositions, content: list[PlacedAoi], segment: int, outcome: GazeOutcome,
    warnings: tuple[str, ...], now: Stamp,
) -> Aois:  # fmt: skip
    """Return the record of areas that moved."""
    return Aois(
        session=state.session, stamp=now, seen=_seen(state), source=positions.source, seq=positions.seq,
        segment=segment, outcome=outcome, t=positions.t, aois=content, warnings=list(warnings),
    )  # fmt: skip


def clock_facts(state: MonitorState, now: Stamp) -> tuple[Clock, ...]:
    """Return the ledgers of the sources as they are recorded, in the order of their first chunks."""
    return tuple(_clock_fact(state, source, ledger, now) for source, ledger in state.ledgers.items())


def running_clock_facts(state: MonitorState, source: str, restarted: bool, now: Stamp) -> tuple[Clock, ...]:
    """Return the ledger of a source after a chunk, if it is recorded now."""
    ledger = state.ledgers.get(source)
    if state.format < 6 or ledger is None or not clock_ledger.is_due(ledger, restarted, now):
        return ()
    return (_clock_fact(state, source, ledger, now),)


def _clock_fact(state: MonitorState, source: str, ledger: ClockLedger, now: Stamp) -> Clock:
    return clock_fact(state.session, _seen(state), source, ledger, now, with_segments=state.format >= 6)


def gaze_result(chunk: GazeChunk, accepted: int, observation: int, warnings: tuple[str, ...]) -> dict[str, Any]:
    """Return the reply to a chunk; ``observation`` is the version that contains it."""
    result: dict[str, Any] = {
        "accepted": accepted, "source": chunk.source, "seq": chunk.seq, "observation": observation,
    }  # fmt: skip
    return {**result, "warnings": list(warnings)} if warnings else result


def _gaze_quality(state: MonitorState, now: Stamp) -> dict[str, Any]:
    """Return the quality of gaze, which a session of format 1 does not record."""
    share = shares(state.stream.account if state.stream else EMPTY_ACCOUNT)
    received = state.received
    return {
        "restarts": state.restarts, "samples": state.samples, "dwell_s": state.attention.dwell_ns / NS,
        "lost": share.lost, "unclassified": share.unclassified, "off_aoi": share.off_aoi,
        "off_stimulus": share.off_stimulus, "received": received,
        "age_s": None if received is None else max(now.ns - received.ns, 0) / NS,
    }  # fmt: skip


def _seen(state: MonitorState) -> Seen:
    gaze = dict(state.former)
    if state.stream is not None:
        gaze[state.stream.source] = state.stream.numbering.last
    return Seen(gaze=gaze, decision=state.decision, performance=state.performance, config=state.config)
