"""Session states: loaded from the journal when they are first needed, and kept in memory."""

from __future__ import annotations

from pathlib import Path

import pytest
from shift_runtime.journal import Batch, Journal
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
