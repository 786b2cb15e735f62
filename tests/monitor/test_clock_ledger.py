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
    since = [(n / 10, seconds - arrivals[0][1]) for n, (_, seconds) in enumerate(arrivals)]
    best: dict[int, tuple[float, float]] = {}
    for own, mesh in since:
        if int(mesh) not in best or mesh - own < best[int(mesh)][1] - best[int(mesh)][0]:
            best[int(mesh)] = own, mesh
    owns, meshes = zip(*[best[second] for second in sorted(best)[1:-1]], strict=True)
    slope = np.polyfit(meshes, owns, 1)[0]
    assert found.drift_ppm == pytest.approx(1e6 * (slope - 1), abs=0.01)
    assert found.drift_ppm == pytest.approx(drift_ppm, abs=15)
    stamps = [round((START.ns / NS + seconds) * NS) for _, seconds in arrivals]
    offsets = [stamp / NS - 20.0 - n / 10 for n, stamp in enumerate(stamps)]
    assert found.offset_s == pytest.approx(min(offsets), abs=1e-5)


def test_samples_that_came_late_do_not_change_the_drift() -> None:
    late = [max(n / 10, 0.9) + 0.01 if n < 20 else n / 10 + 0.01 + 0.4 * (n % 10 > 2) for n in range(300)]
    (found,) = clocks(fed(*((chunk(n, [n / 10 - 0.05, n / 10]), at_s) for n, at_s in enumerate(late)))).values()
    assert found.drift_ppm == pytest.approx(0, abs=1)


def test_jump_within_a_chunk_begins_a_segment() -> None:
    state = fed(*steady(0.0, 50, 0.0), (chunk(50, [5.0, 15.0, 15.05]), 5.1), *steady(15.1, 20, 5.1, seq=51))
    (found,) = clocks(state).values()
    assert found.segments is not None
    assert [s.segment for s in found.segments] == [0, 1]
    assert found.segments[1].step_s == pytest.approx(10.0, abs=0.06)


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


# --- segments, jumps and ledgers of a running session (format 6) ---


def steady(first: float, count: int, arrive: float, seq: int = 0, delay: float = 0.02) -> list[tuple[GazeChunk, float]]:
    """Return chunks of two samples, ten a second, that arrive a little after their last sample."""
    return [
        (chunk(seq + n, [first + n / 10, first + n / 10 + 0.05]), arrive + n / 10 + 0.05 + delay) for n in range(count)
    ]


@pytest.mark.parametrize("step_s", [10.0, -10.0, 2.0, -0.5])
def test_step_of_the_clock_is_a_segment_with_its_size(step_s: float) -> None:
    state = fed(*steady(100.0, 50, 0.0), *steady(105.0 + step_s, 50, 5.0, seq=50))
    (found,) = clocks(state).values()
    assert (found.restarts, found.samples, found.missing, found.chunks) == (1, 200, 0, 100)
    assert found.segments is not None
    first, second = found.segments
    assert (first.segment, first.samples, first.start_s, first.step_s) == (0, 100, 100.0, 0.0)
    assert (second.segment, second.samples, second.start_s) == (1, 100, 105.0 + step_s)
    assert second.step_s == pytest.approx(step_s, abs=1e-6)
    assert state.restarts == 1


def test_pause_of_the_source_is_not_a_jump() -> None:
    state = fed(*steady(0.0, 50, 0.0), *steady(15.0, 50, 15.0, seq=50))
    (found,) = clocks(state).values()
    assert found.restarts == 0
    assert found.longest_gap_s == pytest.approx(15.0 - 4.95)


def test_pause_of_a_recording_that_plays_fast_is_not_a_jump() -> None:
    play = [(each, seconds / 20) for each, seconds in (*steady(0.0, 500, 0.0), *steady(60.0, 50, 60.0, seq=500))]
    (found,) = clocks(fed(*play)).values()
    assert found.restarts == 0


def test_gaze_that_waited_in_the_network_is_not_a_jump() -> None:
    waited = [(each, max(seconds, 9.0)) for each, seconds in steady(5.0, 60, 5.0, seq=50)]
    (found,) = clocks(fed(*steady(0.0, 50, 0.0), *waited)).values()
    assert found.restarts == 0


def test_session_before_format_6_does_not_look_for_jumps() -> None:
    state = fed(*steady(0.0, 50, 0.0), *steady(15.0, 5, 5.0, seq=50), state=replace(configured_session(), format=5))
    (found,) = clocks(state).values()
    assert (found.restarts, found.segments) == (0, None)


def test_restart_of_the_numbering_alone_has_no_step() -> None:
    (found,) = clocks(fed(*steady(0.0, 20, 0.0), *steady(2.0, 20, 2.0))).values()
    assert found.segments is not None
    assert [(s.segment, s.samples) for s in found.segments] == [(0, 40), (1, 40)]
    assert found.segments[1].step_s == pytest.approx(0, abs=1e-6)


def test_ledger_lists_the_last_segments() -> None:
    arrivals = [(chunk(n, [100.0 - n, 100.5 - n]), float(n)) for n in range(60)]
    (found,) = clocks(fed(*arrivals)).values()
    assert found.restarts == 59
    assert found.segments is not None
    assert [s.segment for s in found.segments] == list(range(27, 60))


def test_ledger_is_recorded_every_ten_seconds_and_where_a_segment_begins() -> None:
    state, recorded = configured_session(), []
    for each, seconds in (*steady(0.0, 250, 0.0), *steady(0.0, 10, 25.0, seq=250)):
        done = core.step(state, ChunkWithHistory(each), at(seconds))
        state = done.state
        recorded += [(seconds, fact) for fact in done.facts if isinstance(fact, Clock)]
    assert [round(seconds) for seconds, _ in recorded] == [10, 20, 25]
    assert [fact.restarts for _, fact in recorded] == [0, 0, 1]


def test_what_the_source_measured_of_its_clock_is_kept() -> None:
    measured = [(0.004, 7.5), (0.002, 7.6), (0.009, None)]
    arrivals = [
        (chunk(n, [n / 10]).model_copy(update={"round_trip_s": trip, "offset_s": offset}), n / 10)
        for n, (trip, offset) in enumerate(measured)
    ]
    (found,) = clocks(fed(*arrivals)).values()
    assert (found.round_trip_s, found.source_offset_s) == (0.002, 7.6)
