"""The registry: every table follows from the messages' own declarations."""

from __future__ import annotations

import itertools
import string

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shift_schemas.messages import Command, Fact, Marker, StreamItem
from shift_schemas.registry import (
    COMMANDS,
    FACTS,
    OWNER_OF,
    OWNERS,
    PROCEDURE_OWNER,
    PROCEDURES,
    READS,
    STREAMS,
    SUBJECTS,
    by_name,
    by_owner,
    command_types,
    fact_types,
    stream_types,
)

numbers = itertools.count()
names = st.text(string.ascii_lowercase, max_size=12).map(lambda name: f"{name}_table_{next(numbers)}")
"""Each name is used once in the test run: a declared class lives until it is collected."""


def test_each_fact_and_each_command_has_exactly_one_owner() -> None:
    assert sorted(OWNER_OF) == sorted(SUBJECTS) == sorted(FACTS)
    assert sum(map(len, OWNERS.values())) == len(SUBJECTS)
    assert set(PROCEDURE_OWNER) == set(COMMANDS) == {p for procedures in PROCEDURES.values() for p in procedures}


def test_topics_are_in_the_contract_s_order() -> None:
    assert SUBJECTS == tuple(FACTS) == (
        "session", "config", "gaze", "aois", "clock", "fixation", "observation", "estimate", "decision", "override",
        "performance", "transition", "policy", "marker",
    )  # fmt: skip


def test_tables_are_in_the_order_of_the_owners() -> None:
    assert OWNERS == {
        "recorder": ("session", "config", "marker"),
        "monitor": ("gaze", "aois", "clock", "fixation", "observation"),
        "decider": ("estimate", "decision", "override"),
        "learner": ("performance", "transition", "policy"),
    }
    assert PROCEDURES == {
        "recorder": ("start_session", "end_session", "configure", "mark"),
        "monitor": (),
        "decider": ("decide", "override"),
        "learner": ("report_performance",),
    }
    assert STREAMS == {"gaze": "monitor", "aois": "monitor"}


def test_service_reads_the_owner_of_each_subject_that_it_steps_on() -> None:
    for reads in READS.values():
        for owner, subjects in reads.items():
            assert subjects <= set(OWNERS[owner])


def test_fields_that_the_declarations_name_exist() -> None:
    for fact in FACTS.values():
        assert not fact.number or fact.number in fact.model_fields
    for command in COMMANDS.values():
        assert command.internal <= set(command.model_fields)
        assert command.not_content <= set(command.model_fields)
        assert command.result is None or command.result.owner == command.owner


@given(names, st.sampled_from(sorted(READS)))
def test_declared_class_is_in_the_tables(name: str, owner: str) -> None:
    """A new message is one class: nothing else needs to know of it."""
    fact = type("NewFact", (Fact,), {"owner": owner, "subject": name, "__module__": __name__})
    command = type("NewCommand", (Command,), {"owner": owner, "procedure": name, "__module__": __name__})
    item = type("NewItem", (StreamItem,), {"owner": owner, "stream": name, "__module__": __name__})
    facts, commands = fact_types(), command_types()
    assert (facts[name], commands[name], stream_types()[name]) == (fact, command, item)
    assert [facts[subject] for subject in facts if subject in FACTS] == list(FACTS.values()), "the others stay in order"
    owners = [fact.owner for fact in facts.values() if not fact.listed_last]
    assert owners == sorted(owners, key=list(READS).index)
    assert list(facts)[-1] == "marker"


def test_unknown_owner_is_refused() -> None:
    class Stray(Fact):
        owner = "nobody"
        subject = "stray"

    with pytest.raises(KeyError, match="nobody"):
        by_owner([Stray])
    Stray.owner = "recorder"  # the class lives on until it is collected, and other tests build the tables anew


def test_name_that_two_messages_share_is_refused() -> None:
    with pytest.raises(ValueError, match="Marker2 and Marker have the same subject 'marker'; rename one"):
        by_name([Marker, type("Marker2", (), {"owner": "recorder", "subject": "marker"})], "subject")
