"""The learner's state: its JSON form, and the reported decisions that the journal keeps apart."""

from __future__ import annotations

import random

from shift_learner.core import LearnerState
from shift_learner.state import dump, dump_part, load, parts_of, restore_parts, without_parts
from support.verify_sessions import Session


def learned(interactions: int) -> LearnerState:
    """Return the learner's state after a session of so many interactions."""
    state = Session({"learner": {"name": "q-learning"}}, seed=4).interactions(interactions).states["learner"]
    assert isinstance(state, LearnerState)
    return state


def test_state_is_restored_from_its_rest_and_its_parts_in_any_order() -> None:
    state = learned(20)
    texts = [(name, dump_part(part)) for name, part in parts_of(state).items()]
    random.Random(1).shuffle(texts)
    restored = restore_parts(load(dump(without_parts(state))), dict(texts))
    assert restored == state
    assert list(restored.reported) == list(state.reported)


def test_state_of_an_earlier_version_holds_its_parts() -> None:
    state = learned(5)
    assert load(dump(state)) == state


def test_long_session_has_a_state_of_the_same_size() -> None:
    short, long = (len(dump(without_parts(learned(n)))) for n in (20, 120))
    assert long < 1.1 * short


def test_report_changes_one_part() -> None:
    session = Session({"learner": {"name": "q-learning"}}, seed=4).interactions(10)
    before = parts_of(session.states["learner"])
    session.decide(11, timed_out=False)
    session.deliver()
    session.report(11)
    after = parts_of(session.states["learner"])
    assert [name for name, part in after.items() if before.get(name) is not part] == ["d11"]
