"""The recorder's core: start, end, configuration and markers of a session."""

from __future__ import annotations

import hashlib
import json
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shift_recorder import core
from shift_recorder.core import FinishSession, RecorderState, config_answer, session_answer
from shift_schemas.core_protocol import Step
from shift_schemas.errors import Conflict, InvalidStudy, MalformedMessage, ShiftError, UnknownThing
from shift_schemas.messages import Command, Config, Configure, EndSession, Mark, Marker, Session, StartSession
from shift_schemas.timestamps import Stamp
from shift_study.loading import study_from_json, study_of

NOW, LATER = Stamp(sec=1_700_000_000, nsec=5), Stamp(sec=1_700_000_100, nsec=0)
STUDY: dict[str, Any] = {"study": "mine", "conditions": {"control": {"learner": {"name": "scoring"}}}}


def start(**given: Any) -> StartSession:
    """Return a start whose study was found, as by the shell."""
    return StartSession(**{"command_id": "start", "session": "s1", "participant": "P01", "study": STUDY, **given})


def begun(**given: Any) -> RecorderState:
    """Return the state of a session that has started."""
    return core.step(None, start(**given), NOW).state


def configure(state: RecorderState, patch: dict[str, Any]) -> Step[RecorderState]:
    """Return the result of one change."""
    return core.step(state, Configure(command_id="c1", session="s1", patch=patch), LATER)


def finish(**given: Any) -> FinishSession:
    """Return the second half of an end."""
    done = {"recording": "s1.mcap", "sha256": "ab" * 32, "counts": {"decision": 3}}
    return FinishSession(**{"command_id": "end", "session": "s1", **done, **given})


END = EndSession(command_id="end", session="s1")


# --- start ---


def test_start_publishes_the_session_and_its_configuration() -> None:
    step = core.step(None, start(seed=7, condition="control", software="1.0", revision="abc"), NOW)
    session, config = step.facts
    assert isinstance(session, Session)
    assert isinstance(config, Config)
    assert (session.participant, session.study, session.condition, session.seed) == ("P01", "mine", "control", 7)
    assert (session.state, session.started, session.ended, session.recording) == ("live", NOW, None, "")
    assert (session.software, session.revision) == ("1.0", "abc")
    assert config.version == 1
    assert step.result == session_answer(session)
    assert step.result.keys() >= {"session", "participant", "study", "condition", "seed", "state", "started"}


def test_study_in_force_follows_the_condition_and_the_original_is_kept() -> None:
    state = begun(condition="control")
    assert study_from_json(state.config.study).learner.name == "scoring"
    assert study_of(json.loads(state.original)).learner.name == "q-learning"
    assert study_from_json(begun().config.study).learner.name == "q-learning"


def test_recorded_start_with_an_area_that_is_refused_today_is_derived_again() -> None:
    flat = {"name": "cup", "polygon": [[0.2, 0.2], [0.5, 0.5], [0.8, 0.8]]}
    state = begun(study={"study": "old", "aois": [flat]}, condition=None)
    assert study_from_json(state.config.study).aoi_names == ("cup",)
    assert configure(state, {"reward": {"decay": 0.2}}).state.config.version == 2


def test_missing_seed_is_made_from_the_session_id() -> None:
    assert begun().fact.seed == int.from_bytes(hashlib.sha256(b"s1").digest()[:6], "big")
    assert begun(session="s2").fact.seed != begun().fact.seed
    assert begun(seed=0).fact.seed == 0, "0 is a seed"
    assert begun().fact.seed < 2**53, "any JSON reader keeps its digits"


def test_existing_session_is_not_started_again() -> None:
    with pytest.raises(Conflict, match="is there already"):
        core.step(begun(), start(participant="P02"), NOW)


@pytest.mark.parametrize(
    ("given", "says"),
    [({"condition": "x"}, "it has control"), ({"study": {}}, "study: it is missing"), ({"study": "coffee"}, "study"),
     ({"study": STUDY | {"reward": {"decay": -1}}}, "reward.decay")],
    ids=str,
)  # fmt: skip
def test_invalid_study_starts_nothing(given: dict[str, Any], says: str) -> None:
    with pytest.raises(InvalidStudy, match=says):
        core.step(None, start(**given), NOW)


# --- configure ---


def test_change_increments_the_version_and_builds_on_the_last_one() -> None:
    first = configure(begun(), {"reward": {"scale": 2.0}})
    second = configure(first.state, {"reward": {"decay": 0.2}})
    (fact,) = second.facts
    assert isinstance(fact, Config)
    assert (fact.version, fact.stamp) == (3, LATER)
    assert second.result == config_answer(fact)
    assert second.result["reward"] == {"decay": 0.2, "scale": 2.0}
    assert second.result["version"] == 3


def test_change_of_a_fixed_setting_is_refused_by_name() -> None:
    with pytest.raises(MalformedMessage) as refused:
        configure(begun(), {"tasks": ["a"], "learner": {"name": "scoring"}, "reward": {"scale": 2}})
    assert [e.field for e in refused.value.errors] == ["tasks", "learner.name"]
    assert "tasks, learner.name cannot change while a session runs" in refused.value.detail


@pytest.mark.parametrize(
    "patch", [{"reward": {"decay": "fast"}}, {"rewrad": {}}, {"study": None}, {"version": 1}], ids=str
)
def test_invalid_change_is_refused(patch: dict[str, Any]) -> None:
    with pytest.raises(InvalidStudy):
        configure(begun(), patch)


# --- mark ---


def test_marker_is_a_fact_with_its_id() -> None:
    step = core.step(begun(), Mark(command_id="m1", session="s1", text="laughs ☺"), LATER)
    (fact,) = step.facts
    assert isinstance(fact, Marker)
    assert (fact.marker_id, fact.text, fact.stamp) == ("m1", "laughs ☺", LATER)
    assert step.result is fact


# --- end ---


def test_end_has_two_halves() -> None:
    ending = core.step(begun(), END, LATER)
    (first,) = ending.facts
    assert isinstance(first, Session)
    assert (first.state, first.ended) == ("ending", None)
    done = core.step(ending.state, finish(), NOW)
    (last,) = done.facts
    assert isinstance(last, Session)
    assert (last.state, last.ended, last.recording, last.sha256) == ("ended", LATER, "s1.mcap", "ab" * 32)
    assert done.result == {
        "session": "s1", "state": "ended", "recording": "s1.mcap", "sha256": "ab" * 32, "counts": {"decision": 3},
    }  # fmt: skip


def test_repeated_end_publishes_nothing_while_the_first_is_under_way() -> None:
    ending = core.step(begun(), END, NOW)
    assert core.step(ending.state, END, LATER) == Step(ending.state)


def test_second_half_is_a_repeat_of_the_first() -> None:
    assert finish().content() == END.content(), "so that the same end again gets its result"
    assert finish().procedure == "end_session"


def test_every_attempt_to_finish_gives_the_same_end_time() -> None:
    ending = core.step(begun(), END, NOW).state
    within, outside = core.ended(ending), core.step(ending, finish(), LATER).facts[0]
    assert isinstance(outside, Session)
    assert within.ended == outside.ended == within.stamp == outside.stamp == NOW


def test_session_within_its_own_recording_has_no_checksum() -> None:
    within = core.ended(core.step(begun(), END, NOW).state)
    assert (within.state, within.recording, within.sha256) == ("ended", "s1.mcap", "")


@pytest.mark.parametrize("half", [[END], [END, finish()]], ids=["ending", "ended"])
def test_ending_session_accepts_no_commands(half: list[Command]) -> None:
    state = begun()
    for command in half:
        state = core.step(state, command, NOW).state
    for command in (
        Configure(command_id="c1", session="s1", patch={"reward": {"scale": 2}}),
        Mark(command_id="m1", session="s1", text="late"),
    ):
        with pytest.raises(Conflict, match="has ended"):
            core.step(state, command, LATER)


def test_unknown_session_refuses_everything_but_its_start() -> None:
    for command in (
        END,
        Mark(command_id="m1", session="s1", text=""),
        Configure(command_id="c", session="s1", patch={}),
    ):
        with pytest.raises(UnknownThing, match="no session s1"):
            core.step(None, command, NOW)


# --- state ---

commands = st.one_of(
    st.builds(lambda v: Configure(command_id="c", session="s1", patch={"reward": {"scale": v}}), st.floats(-1, 3)),
    st.builds(
        lambda text: Mark(command_id="m", session="s1", text=text), st.text(st.characters(exclude_categories=["Cs"]))
    ),
    st.sampled_from([END, finish(), start(), Configure(command_id="c", session="s1", patch={"tasks": ["x"]})]),
)


@settings(deadline=None)
@given(st.lists(commands, max_size=12), st.integers(0, 12))
def test_restart_at_any_point_changes_nothing(given_commands: list[Command], at: int) -> None:
    living = restarted = begun(seed=1, condition="control")
    for i, command in enumerate(given_commands):
        if i == at % len(given_commands):
            restarted = core.load(core.dump(restarted))
            assert restarted == living
        results: list[Any] = []
        for state in (living, restarted):
            try:
                results.append(core.step(state, command, LATER))
            except ShiftError as e:
                results.append((type(e), e.detail))
        assert results[0] == results[1]
        if isinstance(results[0], Step):
            living, restarted = results[0].state, results[1].state
