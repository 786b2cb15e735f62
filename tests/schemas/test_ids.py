"""One rule for ids, whoever checks it."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError
from shift_schemas.ids import ID_PATTERN, Id, is_id
from strategies import HOSTILE_IDS, ids

_FIELD = TypeAdapter(Id)


def taken_by_a_field(text: object) -> bool:
    """Whether a message's field takes ``text`` as an id."""
    try:
        return _FIELD.validate_python(text) == text
    except ValidationError:
        return False


@given(ids)
def test_whatever_the_rule_spells_is_an_id(text: str) -> None:
    assert is_id(text)
    assert taken_by_a_field(text)


@pytest.mark.parametrize("text", HOSTILE_IDS, ids=lambda t: ascii(t)[:20])
def test_hostile_ids_are_refused(text: str) -> None:
    assert not is_id(text)
    assert not taken_by_a_field(text)


@given(st.text(max_size=70))
def test_function_and_field_agree_on_any_text(text: str) -> None:
    assert is_id(text) == taken_by_a_field(text) == bool(re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_-]{0,62}", text))


@given(ids)
def test_a_trailing_newline_does_not_slip_through(text: str) -> None:
    assert not is_id(text + "\n")
    assert not taken_by_a_field(text + "\n")


@pytest.mark.parametrize("value", [None, 1, b"a", ["a"], True])
def test_only_text_is_an_id(value: object) -> None:
    assert not is_id(value)


def test_the_schema_that_others_read_has_the_contract_s_pattern() -> None:
    assert ID_PATTERN == "^[A-Za-z0-9][A-Za-z0-9_-]{0,62}$"
    assert _FIELD.json_schema() == {"type": "string", "pattern": ID_PATTERN}
