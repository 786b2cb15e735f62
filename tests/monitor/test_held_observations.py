"""When an observation follows a chunk of gaze, and what is held back until somebody needs it."""

from __future__ import annotations

import random

import pytest
from shift_monitor.core import MonitorState, Show, dump, held, load, step
from shift_schemas.messages import Gaze, GazeChunk, Observation
from support.monitor_sessions import NOW, config, configured_session, decision, names, points, session, study


def chunk(seq: int, source: str = "eyes", start_s: float | None = None) -> GazeChunk:
    """Return 0.1 s of gaze that rests on one AOI."""
    begin = seq * 0.1 if start_s is None else start_s
    return points(seq, [begin + i * 0.01 for i in range(10)], [0.2] * 10, source=source)


def shown(state: MonitorState, *chunks: GazeChunk) -> tuple[MonitorState, list[int]]:
    """Return the state after these chunks, and the numbers of those that an observation followed."""
    found = []
    for each in chunks:
        done = step(state, each, NOW)
        state = done.state
        if isinstance(done.facts[-1], Observation):
            found.append(each.seq)
    return state, found


def test_gaze_that_changes_no_class_is_shown_every_250_ms_of_the_sources_time() -> None:
    _, found = shown(configured_session(), *map(chunk, range(40)))
    later = [seq for seq in found if seq > 10]
    assert later == list(range(later[0], 40, 3))
    assert len(found) < 20


def test_change_of_the_class_is_shown_at_once() -> None:
    state = configured_session()
    categories = []
    for seq in range(40):
        done = step(state, chunk(seq), NOW)
        state = done.state
        alone = step(state, Show(), NOW).facts or done.facts[-1:]
        category = alone[0].gaze.category  # type: ignore[attr-defined]
        if categories and category != categories[-1]:
            assert isinstance(done.facts[-1], Observation)
        categories.append(category)
    assert len(set(categories)) > 1


def test_change_of_the_warnings_is_shown_at_once() -> None:
    state, _ = shown(configured_session(), *map(chunk, range(30)))
    _, found = shown(state, chunk(30, start_s=200.0), chunk(31, start_s=200.1))
    assert found == [30, 31], "the jump of the clock is a warning, and the next chunk has none"


def test_another_source_is_shown_at_once() -> None:
    state, _ = shown(configured_session(), *map(chunk, range(30)))
    assert shown(state, chunk(0, source="other"))[1] == [0]


def test_late_chunk_is_shown_at_once() -> None:
    state, _ = shown(configured_session(), *map(chunk, (*range(30), 31, 32)))
    assert shown(state, chunk(30))[1] == [30]


def test_chunk_s_result_names_the_observation_that_will_show_it() -> None:
    state, _ = shown(configured_session(), *map(chunk, range(30)))
    for seq in range(30, 40):
        done = step(state, chunk(seq), NOW)
        state = done.state
        observation = (*done.facts, *step(state, Show(), NOW).facts)[-1]
        assert isinstance(observation, Observation)
        assert done.result["observation"] == observation.version  # type: ignore[index]
        assert observation.gaze.samples == 10 * (seq + 1)


def test_show_publishes_what_is_held_back_once() -> None:
    state, _ = shown(configured_session(), *map(chunk, range(30)))
    while held(state) is None:
        state, _ = shown(state, chunk(state.samples // 10))
    done = step(state, Show(), NOW)
    assert [f.subject for f in done.facts] == ["observation"]
    assert held(done.state) is None
    assert step(done.state, Show(), NOW).facts == ()


def test_every_other_input_shows_the_gaze_before_it() -> None:
    state, _ = shown(configured_session(), *map(chunk, range(30)))
    while held(state) is None:
        state, _ = shown(state, chunk(state.samples // 10))
    for event in (decision(1), config(study(), 2), session("ending")):
        done = step(state, event, NOW)
        assert isinstance(done.facts[-1], Observation)
        assert done.facts[-1].gaze.samples == state.samples
        assert held(done.state) is None


def test_session_of_format_3_shows_every_chunk() -> None:
    begun = step(None, session().model_copy(update={"format": 3}), NOW).state
    configured = step(begun, config(study()), NOW).state
    assert shown(configured, *map(chunk, range(20)))[1] == list(range(20))


def test_state_keeps_what_was_shown() -> None:
    state, _ = shown(configured_session(), *map(chunk, range(30)))
    state, _ = shown(state, names(0, [10.0, 10.1], ["left", "right"]))
    assert load(dump(state)) == state
    assert state.shown is not None


@pytest.mark.parametrize("seed", range(5))
def test_observations_change_nothing_of_the_model(seed: int) -> None:
    rng = random.Random(seed)
    quiet = asked = configured_session()
    for seq in range(60):
        event = chunk(seq) if rng.random() < 0.9 else decision(quiet.decision + 1)
        quiet, asked = step(quiet, event, NOW).state, step(asked, event, NOW).state
        if rng.random() < 0.5:
            asked = step(asked, Show(), NOW).state
    assert asked.version > quiet.version
    last = [step(s, Show(), NOW).state for s in (quiet, asked)]
    model = [(s.attention, s.capacity, s.stream, s.samples, s.fixations) for s in last]
    assert model[0] == model[1]


def test_chunks_are_recorded_though_no_observation_follows() -> None:
    state, _ = shown(configured_session(), *map(chunk, range(30)))
    done = step(state, chunk(30), NOW)
    assert isinstance(done.facts[0], Gaze)
    assert done.facts[0].seq == 30
