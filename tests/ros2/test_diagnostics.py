"""Counts, and their text at most every so often; who is tracked and how engaged."""

from __future__ import annotations

import json
from typing import Any

import pytest
from shift_ros2.diagnostics import TOPICS, Diagnostics
from shift_ros2.ros4hri import Persons, level_of, person_of, tracked_of
from shift_schemas.errors import FieldError, MalformedMessage

ERROR = MalformedMessage("gaze: t: it must rise", (FieldError(field="t", value="1", rule="it must rise"),))


def said(text: str | None) -> Any:
    assert text is not None
    return json.loads(text)


def test_a_million_bad_messages_are_one_text_a_second() -> None:
    diagnostics = Diagnostics(1.0)
    texts = []
    for i in range(100_000):
        diagnostics.count_lost("gaze", ERROR)
        text = diagnostics.report(i / 20_000)
        texts += [text] if text else []
    assert len(texts) == 5
    assert said(diagnostics.report(9.0))["dropped"] == {"gaze": {"malformed": 100_000}}
    assert diagnostics.report(99.0) is None, "no news, no text"


def test_it_says_what_was_wrong_and_where() -> None:
    diagnostics = Diagnostics(1.0)
    diagnostics.count_received("gaze", 3)
    diagnostics.count_lost("gaze", ERROR, 2, "overload")
    diagnostics.set_state("ready")
    found = said(diagnostics.report(0.0, node="shift", session="s1"))
    assert found["state"] == "ready"
    assert found["received"] == {"gaze": 3}
    assert found["dropped"] == {"gaze": {"overload": 2}}
    assert found["last"]["errors"] == [{"field": "t", "value": "1", "rule": "it must rise"}]
    assert (found["node"], found["session"]) == ("shift", "s1")


def test_a_new_state_is_news() -> None:
    diagnostics = Diagnostics(1.0)
    assert said(diagnostics.report(0.0))["state"] == "starting"
    diagnostics.set_state("ready")
    assert diagnostics.report(0.5) is None
    assert said(diagnostics.report(1.0))["state"] == "ready"
    diagnostics.set_state("ready")
    assert diagnostics.report(5.0) is None


def test_names_of_others_do_not_fill_the_memory() -> None:
    diagnostics = Diagnostics(1.0)
    for i in range(1000):
        diagnostics.count_lost(f"topic{i}", ERROR)
    assert len(diagnostics.dropped) == TOPICS + 1
    assert sum(diagnostics.dropped.values()) == 1000


# --- ROS4HRI ---

HEADER = bytes.fromhex("000100000100000002000000040000006d617000")
"""Stamp 1 s 2 ns, frame "map"."""


def test_hri_messages_are_read_from_their_bytes() -> None:
    ids = HEADER + bytes.fromhex("02000000030000006131000003000000623200")
    assert tracked_of(ids) == ["a1", "b2"]
    assert level_of(HEADER + b"\x03") == 3
    assert person_of("/humans/persons/a1/engagement_status") == "a1"
    with pytest.raises(MalformedMessage, match="too short"):
        tracked_of(HEADER + b"\xff\xff\xff\xff")


def test_a_marker_is_written_where_something_changes() -> None:
    persons = Persons()
    assert persons.tracked(["b", "a"]) == "ROS4HRI tracked: a, b"
    assert persons.tracked(["a", "b"]) is None
    assert persons.engagement("a", 3) == "ROS4HRI engagement of a: engaged"
    assert persons.engagement("a", 3) is None
    assert persons.tracked([]) == "ROS4HRI tracked: nobody"
    assert persons.engagement("a", 3) == "ROS4HRI engagement of a: engaged", "somebody who comes back is new"
    with pytest.raises(MalformedMessage, match="0 to 4"):
        persons.engagement("a", 9)
