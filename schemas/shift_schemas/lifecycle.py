"""The lifecycle of a session: live, ending, ended. Pure.

A session is live from its start. Its end is accepted first (ending: no more input), and is complete once its recording
is finished (ended). Every service follows the same table.
"""

from __future__ import annotations

from typing import Final

from shift_schemas.errors import Conflict
from shift_schemas.messages.base import Command, SessionEvent, SessionState

LIVE: Final = "live"
ENDING: Final = "ending"
ENDED: Final = "ended"

TRANSITIONS: Final[dict[tuple[SessionState, SessionEvent], SessionState]] = {
    (LIVE, "input"): LIVE,
    (LIVE, "end"): ENDING,
    (ENDING, "end"): ENDING,
    (ENDING, "finish"): ENDED,
    (ENDED, "end"): ENDED,
}
"""The next state by state and event; a pair that is missing is refused. A repeated end gets the first result."""


def accepts(state: SessionState, command: Command | type[Command]) -> bool:
    """Return whether a session in ``state`` accepts the command."""
    return (state, command.event) in TRANSITIONS


def check_accepts(session: str, state: SessionState, command: Command | type[Command]) -> None:
    """Raise :class:`Conflict` if the session does not accept the command in its ``state``."""
    if not accepts(state, command):
        raise Conflict(f"session {session} has ended")


def next_state(state: SessionState, command: Command | type[Command]) -> SessionState:
    """Return the state after the command. Raise :class:`KeyError` if the session does not accept it."""
    return TRANSITIONS[state, command.event]


def accepts_input(state: SessionState) -> bool:
    """Return whether a session in ``state`` still accepts gaze, decisions, results, markers and configurations."""
    return (state, "input") in TRANSITIONS


def is_ending(state: SessionState) -> bool:
    """Return whether the end was accepted and the recording is not finished yet."""
    return state == ENDING


def has_ended(state: SessionState) -> bool:
    """Return whether the session ended and its recording is finished."""
    return state == ENDED
