"""Session states: loaded from the journal when they are first needed, and kept in memory."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import pytest
from shift_runtime.journal import Batch, Journal
from shift_runtime.service.core import Parts
from shift_runtime.service.states import SessionStates
from support.worker_rig import CORE, Notes, dump

ONE = Notes("s1", 1, ("one",))


@pytest.fixture
def states(tmp_path: Path) -> SessionStates[Notes]:
    journal = Journal(tmp_path / "decider.sqlite", "decider")
    journal.commit(Batch(states={"s1": dump(ONE)}))
    return SessionStates(CORE, journal)


def test_state_is_loaded_once_from_the_journal(states: SessionStates[Notes]) -> None:
    assert states.loaded("s1") is None
    assert states.get("s1") == ONE
    assert states.get("s1") is states.loaded("s1")
    assert len(states) == 1


def test_session_without_a_state_has_none(states: SessionStates[Notes]) -> None:
    assert states.get("s2") is None
    assert len(states) == 0


def test_state_in_memory_comes_before_the_journal(states: SessionStates[Notes]) -> None:
    later = Notes("s1", 2)
    states.put("s1", later)
    assert states.get("s1") is later
    assert states.dump("s1") == dump(later)
    states.unload("s1")
    assert states.get("s1") == ONE


def test_restore_puts_back_a_state_or_its_absence(states: SessionStates[Notes]) -> None:
    states.put("s1", Notes("s1", 2))
    states.restore("s1", ONE)
    assert states.get("s1") is ONE
    states.put("s2", Notes("s2"))
    states.restore("s2", None)
    assert states.get("s2") is None


# --- parts that are kept apart ---


def by_name(state: Notes) -> dict[str, str]:
    """Return each note as a part, under its own text."""
    return {note: note for note in state.notes}


def with_notes(state: Notes, parts: Mapping[str, str]) -> Notes:
    """Return the state with its notes, in alphabetical order."""
    return replace(state, notes=tuple(sorted(json.loads(text) for text in parts.values())))


APART = replace(CORE, parts=Parts(by_name, lambda state: replace(state, notes=()), json.dumps, with_notes))


@pytest.fixture
def apart(tmp_path: Path) -> tuple[Journal, SessionStates[Notes]]:
    journal = Journal(tmp_path / "decider.sqlite", "decider")
    return journal, SessionStates(APART, journal)


def commit(journal: Journal, states: SessionStates[Notes]) -> dict[str, str | None]:
    """Commit the session's state as the worker does. Return the parts that are written."""
    changed = states.changed_parts("s1")
    parts = {("s1", name): text for name, text in changed.items()}
    journal.commit(Batch(states={"s1": states.dump("s1")}, parts=parts))
    states.committed("s1")
    return changed


def test_commit_writes_the_parts_that_changed_alone(apart: tuple[Journal, SessionStates[Notes]]) -> None:
    journal, states = apart
    states.put("s1", Notes("s1", 1, ("a", "b")))
    assert commit(journal, states) == {"a": '"a"', "b": '"b"'}
    states.put("s1", Notes("s1", 2, ("b", "c")))
    assert commit(journal, states) == {"c": '"c"', "a": None}
    assert journal.parts("s1") == {"b": '"b"', "c": '"c"'}
    assert commit(journal, states) == {}


def test_state_is_loaded_with_its_parts(apart: tuple[Journal, SessionStates[Notes]]) -> None:
    journal, states = apart
    whole = Notes("s1", 1, ("a", "b"))
    states.put("s1", whole)
    commit(journal, states)
    assert APART.load(journal.state("s1") or "") == Notes("s1", 1)
    again = SessionStates(APART, journal)
    assert again.get("s1") == whole
    assert again.changed_parts("s1") == {}


def test_journal_without_parts_has_them_in_the_state(apart: tuple[Journal, SessionStates[Notes]]) -> None:
    journal, states = apart
    journal.commit(Batch(states={"s1": dump(ONE)}))
    assert states.get("s1") == ONE
    assert commit(journal, states) == {"one": '"one"'}
    assert SessionStates(APART, journal).get("s1") == ONE


def test_parts_of_a_refused_commit_are_written_with_the_next(apart: tuple[Journal, SessionStates[Notes]]) -> None:
    _, states = apart
    states.put("s1", Notes("s1", 1, ("a",)))
    assert states.changed_parts("s1") == states.changed_parts("s1") == {"a": '"a"'}
