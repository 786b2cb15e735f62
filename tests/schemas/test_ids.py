"""The rule for ids, and proposals for texts that break it."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError
from shift_schemas.errors import MalformedMessage, check_id, malformed
from shift_schemas.ids import ID_PATTERN, Id, is_id, not_an_id, propose_id
from support.message_strategies import HOSTILE_IDS, ids

_FIELD = TypeAdapter(Id)


def accepted_by_a_field(text: object) -> bool:
    """Return whether a message's field accepts ``text`` as an id."""
    try:
        return _FIELD.validate_python(text) == text
    except ValidationError:
        return False


@given(ids)
def test_text_that_follows_the_rule_is_an_id(text: str) -> None:
    assert is_id(text)
    assert accepted_by_a_field(text)


@pytest.mark.parametrize("text", HOSTILE_IDS, ids=lambda t: ascii(t)[:20])
def test_hostile_ids_are_refused(text: str) -> None:
    assert not is_id(text)
    assert not accepted_by_a_field(text)


@given(st.text(max_size=70))
def test_function_and_field_agree_on_any_text(text: str) -> None:
    assert is_id(text) == accepted_by_a_field(text) == bool(re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_-]{0,62}", text))


@given(ids)
def test_id_with_a_trailing_newline_is_refused(text: str) -> None:
    assert not is_id(text + "\n")
    assert not accepted_by_a_field(text + "\n")


@pytest.mark.parametrize("value", [None, 1, b"a", ["a"], True])
def test_only_text_is_an_id(value: object) -> None:
    assert not is_id(value)


def test_json_schema_has_the_contract_s_pattern() -> None:
    assert ID_PATTERN == "^[A-Za-z0-9][A-Za-z0-9_-]{0,62}$"
    assert _FIELD.json_schema() == {"type": "string", "pattern": ID_PATTERN}


# --- the sentence and the proposal ---


@pytest.mark.parametrize(
    ("text", "proposed"),
    [("P 01", "P-01"), ("Müller", "Mueller"), ("P01 ", "P01"), ("P.01", "P-01"), ("a/b", "a-b"), ("_p1", "p1"),
     ("-P1", "P1"), ("Ｐ０１", "P01"), ("١٢", "12"), ("", "P01"), ("**", "P01"), ("grasp\u200b", "grasp"),
     ("anna@example.org", "anna-example-org"), ("2024-11-25T10:00", "2024-11-25T10-00"), ("Ünïcødé", "Uenicoede"),
     ("U\u0308bung", "Uebung"), ("tasse - füllen", "tasse-fuellen"), ("P" * 64, "P" * 63), ("P01\n", "P01")],
)  # fmt: skip
def test_proposal_resembles_the_text(text: str, proposed: str) -> None:
    assert propose_id(text) == proposed


@given(st.text(max_size=200))
def test_every_proposal_is_an_id(text: str) -> None:
    assert is_id(propose_id(text))
    assert propose_id(propose_id(text)) == propose_id(text)


def test_path_and_field_are_refused_with_the_same_sentence() -> None:
    sentence = (
        "'P 01' is not an id: 1 to 63 letters, digits, - and _, beginning with a letter or digit; for example P-01"
    )
    with pytest.raises(MalformedMessage) as path:
        check_id("participant", "P 01")
    with pytest.raises(ValidationError) as field:
        _FIELD.validate_python("P 01")
    assert path.value.detail == f"participant: {sentence}"
    assert [e.rule for e in (*path.value.errors, *malformed("body", field.value).errors)] == [sentence] * 2
    assert check_id("participant", "P-01") == "P-01"


def test_long_text_is_truncated_in_the_sentence() -> None:
    assert len(not_an_id("ä" * 60_000)) < 250
