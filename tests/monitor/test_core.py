"""The monitor's fold: accepted and refused messages, and the reproduction of its outputs."""

from __future__ import annotations

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shift_monitor.core import MonitorState, Show, dump, gaze_chunk_of, initial, load, step
from shift_schemas.core_protocol import InputsMissing
from shift_schemas.errors import Conflict, Unavailable, UnknownThing
from shift_schemas.messages import (
    Config,
    Decision,
    Fact,
    Gaze,
    GazeChunk,
    Marker,
    Message,
    Observation,
    Performance,
    Session,
)
from shift_schemas.timestamps import Stamp
from shift_sources.files.samples import Sample, chunks
from support.monitor_sessions import (
    NEGATION,
    NOW,
    RECORDINGS,
    config,
    configured_session,
    decision,
    fixations,
    fold,
    last,
    names,
    performance,
    played,
    points,
    recording,
    session,
    study,
)

REAL = recording(RECORDINGS[2])  # the recording with the most loss


# --- independence of chunking ---


@settings(max_examples=25, deadline=None)
@given(cuts=st.lists(st.integers(1, 80), min_size=1, max_size=40), start=st.integers(0, len(REAL) - 300))
def test_any_cut_of_the_same_samples_gives_identical_results(cuts: list[int], start: int) -> None:
    taken = REAL[start : start + 300]
    whole, facts = played(taken, 300)
    parts, seq, at = [], 0, 0
    while at < len(taken):
        n = cuts[seq % len(cuts)]
        (chunk,) = chunks(taken[at : at + n], n)
        parts.append(chunk.model_copy(update={"seq": seq}))
        seq, at = seq + 1, at + n
    cut, cut_facts = fold(configured_session(), *parts, session("ending"))
    assert cut.attention == whole.attention
    assert spans(cut_facts) == spans(facts)
    assert last(cut_facts).gaze == last(facts).gaze


@settings(max_examples=60, deadline=None)
@given(
    gaze=st.lists(st.tuples(st.integers(1, 1500), st.sampled_from(["left", "right", None])), min_size=2, max_size=40),
    n=st.integers(1, 10),
)
def test_any_cut_of_the_same_names_gives_identical_results(gaze: list[tuple[int, str | None]], n: int) -> None:
    t, now = [], 0.0
    for wait_ms, _ in gaze:
        now += wait_ms / 1000
        t.append(now)
    aoi = [name for _, name in gaze]
    whole, _ = fold(configured_session(), names(0, t, aoi))
    cut, _ = fold(
        configured_session(), *(names(seq, t[i : i + n], aoi[i : i + n]) for seq, i in enumerate(range(0, len(t), n)))
    )
    assert cut.attention == whole.attention


def spans(facts: list[Fact]) -> list[tuple[float, float, float, float, str]]:
    return [(f.start_s, f.duration_s, f.x, f.y, f.aoi) for f in fixations(facts)]


# --- a live session, and its reproduction ---


def a_session(seed: int) -> list[Message]:
    """Return real gaze with decisions, results, a configuration, a source change, gaps, repeats and a late chunk."""
    rng = random.Random(seed)
    gaze: list[GazeChunk] = list(chunks(REAL[:500], 10, "tx300"))
    late = gaze.pop(7)
    gaze.insert(9, late)
    del gaze[20:22]
    gaze.insert(30, gaze[29])
    gaze += [names(3 + i, [i / 4], [rng.choice(["left", "right", None])]) for i in range(12)]
    events: list[Message] = []
    n = 0
    for i, chunk in enumerate(gaze):
        events.append(chunk)
        if rng.random() < 0.3:
            n += 1
            events.append(decision(n, rng.choice([NEGATION, {"negation": "affirmation", "hesitation": "none"}])))
            events.append(performance(n, rng.random() < 0.5, rng.random() < 0.5, rng.choice(["grasp", "pour"])))
        if i == 25:
            events.append(config(study(attention={"weight_step": 0.03}, awareness={"window": 4}), version=2))
    return [session(), config(study()), *events, session("ending")]


@pytest.mark.parametrize("seed", range(5))
def test_dumped_and_loaded_state_continues_identically(seed: int) -> None:
    rng = random.Random(seed)
    state: MonitorState | None = None
    other: MonitorState | None = None
    for event in a_session(seed):
        done, again = step(state, event, NOW), step(other, event, NOW)
        assert again == done
        state = done.state
        other = load(dump(state)) if rng.random() < 0.5 else again.state
        assert other == state


@pytest.mark.parametrize("seed", range(5))
def test_inputs_follow_from_outputs_and_give_the_same_outputs(seed: int) -> None:
    """Fold recorded gaze, decisions, results and configurations in the order of ``seen``, as ``verify`` does."""
    events = a_session(seed)
    _, facts = fold(None, *events)
    decisions = {e.n: e for e in events if isinstance(e, Decision)}
    results = {e.n: e for e in events if isinstance(e, Performance)}
    configs = {e.version: e for e in events if isinstance(e, Config)}
    inputs: list[Message] = [session()]
    before = (0, 0, 0)
    pending: list[Gaze] = []
    for fact in facts:
        if isinstance(fact, Gaze):
            pending.append(fact)
        if not isinstance(fact, Observation):
            continue
        seen = (fact.seen.decision, fact.seen.performance, fact.seen.config)
        if pending:
            inputs.append(gaze_chunk_of(pending.pop()))
        elif seen[0] != before[0]:
            inputs.append(decisions[seen[0]])
        elif seen[1] != before[1]:
            inputs.append(results[seen[1]])
        elif seen[2] != before[2]:
            inputs.append(configs[seen[2]])
        else:
            inputs.append(session("ending"))
        before = seen
    _, again = fold(None, *inputs)
    assert [_derivable(f) for f in again] == [_derivable(f) for f in facts]


def _derivable(fact: Fact) -> str:
    """Return a fact without what no other fact records: how many chunks were repeated and refused."""
    return fact.model_dump_json(exclude={"repeated", "refused"})


@pytest.mark.parametrize("seed", range(3))
def test_every_applied_input_is_shown_by_one_observation_of_the_next_version(seed: int) -> None:
    state, version = None, 0
    for event in a_session(seed):
        done = step(state, event, NOW)
        shown = step(done.state, Show(), NOW)
        state, facts = shown.state, (*done.facts, *shown.facts)
        found = [f for f in facts if isinstance(f, Observation)]
        if facts:
            version += 1
            assert [f.version for f in found] == [version]
            assert facts[-1] is found[0]
            assert all(f.seen == found[0].seen for f in facts)
        assert state.version == version


def test_facts_carry_the_given_stamp() -> None:
    stamp = Stamp(sec=5, nsec=6)
    done = step(configured_session(), names(0, [0.0], ["left"]), stamp)
    assert {f.stamp for f in done.facts} == {stamp}


# --- sessions and configurations ---


def test_first_configuration_publishes_the_first_observation() -> None:
    state, facts = fold(None, session())
    assert facts == []
    assert state == initial(session())
    _, facts = fold(state, config(study(capacity={"start": 0.4})))
    observation = last(facts)
    assert observation.version == 1
    assert (observation.capacity.value, observation.capacity.category) == (0.4, "low")
    assert observation.gaze.category == "uncertain"
    assert set(observation.gaze.weights.values()) == {1 / 3}
    assert observation.awareness == {}
    assert observation.seen.config == 1


def test_later_configuration_changes_settings_and_keeps_the_partner_model() -> None:
    state, _ = fold(configured_session(), decision(1), names(0, [0.0, 0.2], ["left", "left"]))
    after, facts = fold(state, config(study(capacity={"threshold": 0.95}), version=2))
    assert after.attention == state.attention
    assert last(facts).capacity.value == pytest.approx(0.9)
    assert last(facts).capacity.category == "low"


def test_message_without_a_session_is_refused() -> None:
    for event in (config(study()), names(0, [0.0], ["left"]), decision(1)):
        with pytest.raises(UnknownThing):
            step(None, event, NOW)


@pytest.mark.parametrize("event", [names(0, [0.0], ["left"]), decision(1), performance(1, True, True)])
def test_message_before_the_configuration_waits(event: Message) -> None:
    state, _ = fold(None, session())
    with pytest.raises(InputsMissing):
        step(state, event, NOW)
    with pytest.raises(Unavailable):
        step(state, event, NOW, timed_out=True)


def test_message_of_another_kind_changes_nothing() -> None:
    state = configured_session()
    done = step(state, Marker(session="s1", stamp=NOW, marker_id="m1", text="hm"), NOW)
    assert (done.state, done.facts) == (state, ())
    assert step(state, session(), NOW).facts == ()


def test_end_of_a_session_ends_the_open_fixation_and_refuses_more_gaze() -> None:
    t = [i / 100 for i in range(50)]
    state, facts = fold(configured_session(), points(0, t, [0.5] * 50), session("ending"))
    assert len(fixations(facts)) == 1
    assert fold(state, session("ended"))[1] == []
    with pytest.raises(Conflict, match="has ended"):
        step(state, points(1, [1.0], [0.5]), NOW)


def test_session_that_ends_before_its_configuration_publishes_nothing() -> None:
    state, facts = fold(None, session(), session("ending"))
    assert (state.ended, facts) == (True, [])


samples = st.tuples(
    st.floats(0.0001, 0.2), st.one_of(st.none(), st.floats(-0.5, 1.5)), st.floats(-0.5, 1.5), st.booleans()
)


@settings(max_examples=60, deadline=None)
@given(st.lists(samples, min_size=1, max_size=80), st.integers(1, 9))
def test_any_gaze_keeps_the_model_within_its_bounds(
    gaze: list[tuple[float, float | None, float, bool]], n: int
) -> None:
    t, taken = 0.0, []
    for wait, x, y, valid in gaze:
        t += wait
        taken.append(Sample(t, x, y, valid and x is not None))
    state, facts = played(taken, n)
    for fact in facts:
        if isinstance(fact, Observation):
            assert sum(fact.gaze.weights.values()) == pytest.approx(1.0, abs=1e-12)
            assert min(fact.gaze.weights.values()) >= 0.0
            assert 0.0 <= fact.gaze.focus_shift <= 1.0
    assert len(fixations(facts)) == last(facts).gaze.fixations
    assert load(dump(state)) == state


def test_session_message_begins_a_session() -> None:
    assert isinstance(session(), Session)
    assert step(None, session(), NOW).state == initial(session())
