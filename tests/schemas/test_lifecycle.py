"""The lifecycle of a session: one table of transitions for every service."""

from typing import get_args

import pytest
from shift_schemas.errors import Conflict
from shift_schemas.lifecycle import (
    ENDED,
    ENDING,
    LIVE,
    TRANSITIONS,
    accepts,
    accepts_input,
    check_accepts,
    has_ended,
    is_ending,
    next_state,
)
from shift_schemas.messages import Decide, EndSession, Mark, SessionEvent, SessionState

STATES: tuple[SessionState, ...] = get_args(SessionState)


def test_table_knows_every_state_and_every_event() -> None:
    assert {state for state, _ in TRANSITIONS} == set(STATES) == {LIVE, ENDING, ENDED}
    assert {event for _, event in TRANSITIONS} == set(get_args(SessionEvent))


@pytest.mark.parametrize("state", STATES)
def test_only_a_live_session_accepts_input(state: SessionState) -> None:
    assert accepts(state, Decide) == accepts_input(state) == (state == LIVE)
    assert accepts(state, EndSession)


def test_refused_command_names_the_session() -> None:
    check_accepts("s1", LIVE, Mark)
    with pytest.raises(Conflict, match="session s1 has ended"):
        check_accepts("s1", ENDING, Mark)


def test_states_follow_in_order_and_input_changes_none() -> None:
    assert next_state(LIVE, Mark) == LIVE
    assert next_state(LIVE, EndSession) == next_state(ENDING, EndSession) == ENDING
    assert TRANSITIONS[ENDING, "finish"] == next_state(ENDED, EndSession) == ENDED
    assert [s for s in STATES if is_ending(s)] == [ENDING]
    assert [s for s in STATES if has_ended(s)] == [ENDED]
