"""The ledger of a gaze source: what came and what did not is counted, and its clock is measured beside the mesh's."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from shift_monitor import core
from shift_monitor.core import MonitorState
from shift_monitor.gaze_input import COLUMNS, ChunkWithHistory, RecordedChunk
from shift_schemas.errors import MalformedMessage
from shift_schemas.messages import Clock, GazeChunk
from shift_schemas.timestamps import NS, Stamp
from support.monitor_sessions import configured_session, session

START = Stamp.of(1_700_000_000 * NS)


def chunk(seq: int, t: list[float], source: str = "tx") -> GazeChunk:
    return GazeChunk(source=source, seq=seq, t=t, aoi=["left"] * len(t))


def at(seconds: float) -> Stamp:
    return Stamp.of(START.ns + round(seconds * NS))


def fed(*arrivals: tuple[GazeChunk, float], state: MonitorState | None = None) -> MonitorState:
    """Return the state after chunks that arrive at these seconds."""
    state = state or configured_session()
    used: dict[tuple[str, int], list[RecordedChunk]] = {}
    for each, seconds in arrivals:
        earlier = used.setdefault((each.source, each.seq), [])
        done = core.step(state, ChunkWithHistory(each, tuple(earlier)), at(seconds))
        state = done.state
        earlier.append(RecordedChunk(state.stream.segment if state.stream else 0, len(each.t), (), None))
    return state


def clocks(state: MonitorState) -> dict[str, Clock]:
    """Return the ledgers that the end of the session publishes."""
    facts = core.step(state, session("ending"), at(1000)).facts
    return {fact.source: fact for fact in facts if isinstance(fact, Clock)}


def test_chunks_are_counted_by_what_became_of_them() -> None:
    state = fed(
        (chunk(0, [0.0, 0.1]), 0.0), (chunk(3, [0.3, 0.4]), 0.3), (chunk(1, [0.15]), 0.35), (chunk(4, [0.5]), 0.5),
        (chunk(0, [7.0, 7.1], "spare"), 1.0),
    )  # fmt: skip
    found = clocks(state)
    assert list(found) == ["tx", "spare"]
    tx = found["tx"]
    assert (tx.chunks, tx.samples, tx.late, tx.missing, tx.restarts) == (3, 5, 1, 1, 0)
    assert (found["spare"].chunks, found["spare"].missing) == (1, 0)


def test_repeated_and_refused_chunks_are_counted() -> None:
    state = fed((chunk(0, [0.0, 0.1]), 0.0))
    same = RecordedChunk(0, 2, (), ([0.0, 0.1], COLUMNS | {"aoi": ["left", "left"]}))
    for _ in range(3):
        state = core.step(state, ChunkWithHistory(chunk(0, [0.0, 0.1]), (same,)), at(1)).state
    wrong = GazeChunk(source="tx", seq=1, t=[0.2], aoi=["nowhere"])
    with pytest.raises(MalformedMessage) as e:
        core.step(state, ChunkWithHistory(wrong), at(2))
    for message in (wrong, ChunkWithHistory(wrong)):
        state = core.refused(state, message, e.value)
    (found,) = clocks(state).values()
    assert (found.repeated, found.refused, found.chunks) == (3, {"malformed": 2}, 1)


def test_sources_that_only_send_nonsense_are_bounded() -> None:
    state = configured_session()
    error = MalformedMessage("no")
    for i in range(300):
        state = core.refused(state, chunk(0, [0.0], f"s{i}"), error)
    assert len(state.ledgers) == 256


def test_restarts_are_counted_and_begin_the_clock_anew() -> None:
    state = fed(
        (chunk(0, [100.0, 100.1]), 0.0), (chunk(1, [100.2]), 0.2), (chunk(2, [5.0, 5.1]), 1.0), (chunk(3, [5.2]), 1.2)
    )
    (found,) = clocks(state).values()
    assert (found.restarts, found.samples, found.missing) == (1, 6, 0)
    assert found.longest_gap_s == pytest.approx(0.1)
    assert found.rate_hz == pytest.approx(10)
    assert found.offset_s == pytest.approx(START.ns / NS + 1.0 - 5.1)


@pytest.mark.parametrize("drift_ppm", [-200.0, 0.0, 50.0])
def test_offset_and_drift_are_those_that_were_injected(drift_ppm: float) -> None:
    rng = np.random.default_rng(3)
    delays = 0.005 + rng.exponential(0.002, 600)
    arrivals: list[Any] = []
    for n, delay in enumerate(delays):
        own = n / 10
        arrivals.append((chunk(n, [20.0 + own - 0.05, 20.0 + own]), own / (1 + drift_ppm * 1e-6) + delay))
    (found,) = clocks(fed(*arrivals)).values()
    mesh = np.array([seconds for _, seconds in arrivals])
    slope = np.polyfit(mesh - mesh[0], np.arange(600) / 10, 1)[0]
    assert found.drift_ppm == pytest.approx(1e6 * (slope - 1), abs=0.01)
    assert found.drift_ppm == pytest.approx(drift_ppm, abs=40)
    stamps = [round((START.ns / NS + seconds) * NS) for _, seconds in arrivals]
    offsets = [stamp / NS - 20.0 - n / 10 for n, stamp in enumerate(stamps)]
    assert found.offset_s == pytest.approx(min(offsets), abs=1e-5)


def test_clock_of_a_short_source_is_not_known() -> None:
    (found,) = clocks(fed((chunk(0, [0.0]), 0.0), (chunk(1, [1.0]), 1.0))).values()
    assert found.drift_ppm is None
    assert found.rate_hz == pytest.approx(1)


def test_session_before_format_5_keeps_no_ledger() -> None:
    state = fed((chunk(0, [0.0]), 0.0), state=replace(configured_session(), format=4))
    assert state.ledgers == {}
    assert clocks(state) == {}


def test_state_is_restored_exactly() -> None:
    state = fed((chunk(0, [0.0, 0.1]), 0.0), (chunk(4, [0.7]), 0.9))
    assert core.load(core.dump(state)) == state
