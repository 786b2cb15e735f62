"""Errors travel as problems and arrive as the same errors."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import BaseModel, ValidationError
from shift_schemas.codec import decode, encode
from shift_schemas.errors import (
    VALUE_LENGTH,
    Conflict,
    DamagedRecording,
    FieldError,
    InvalidSettings,
    InvalidStudy,
    MalformedMessage,
    Problem,
    ShiftError,
    TooLarge,
    Unavailable,
    UnknownThing,
    malformed,
    shorten,
)

STATUS = {
    ShiftError: 500, MalformedMessage: 422, InvalidStudy: 422, UnknownThing: 404, Conflict: 409, TooLarge: 413,
    Unavailable: 503, InvalidSettings: 500, DamagedRecording: 422,
}  # fmt: skip
words = st.text(st.characters(exclude_categories=["Cs"]), max_size=50)


@given(st.sampled_from(list(STATUS)), words, st.lists(st.builds(FieldError, field=words, value=words, rule=words)))
def test_problem_arrives_as_the_same_error(kind: type[ShiftError], detail: str, errors: list[FieldError]) -> None:
    sent = kind(detail, tuple(errors))
    arrived = decode(Problem, encode(Problem.of(sent))).error()
    assert type(arrived) is kind
    assert (arrived.detail, arrived.errors, arrived.status) == (sent.detail, sent.errors, STATUS[kind])


def test_problem_of_an_unknown_kind_is_a_plain_error() -> None:
    assert type(Problem(kind="from-the-future", detail="?").error()) is ShiftError


@given(st.text() | st.integers() | st.floats() | st.lists(st.text()))
def test_shortened_value_is_short_and_printable(value: object) -> None:
    said = shorten(value)
    assert len(said) <= VALUE_LENGTH
    assert said.isprintable()


def test_long_value_is_truncated_with_an_ellipsis() -> None:
    assert shorten("x" * 65536) == "x" * (VALUE_LENGTH - 1) + "…"
    assert shorten("\ud800\0") == "��"


class _Body(BaseModel):
    a: int
    b: str


def test_every_mistake_has_field_value_and_rule() -> None:
    with pytest.raises(ValidationError) as found:
        _Body.model_validate({"a": "x" * 1000})
    error = malformed("body", found.value)
    assert error.detail == f"body: a: {error.errors[0].rule}"
    assert [(e.field, e.value) for e in error.errors] == [("a", "x" * (VALUE_LENGTH - 1) + "…"), ("b", "")]


def test_at_most_20_mistakes_are_listed() -> None:
    with pytest.raises(ValidationError) as found:
        _Many.model_validate({"numbers": ["x"] * 100})
    assert len(malformed("body", found.value).errors) == 20


class _Many(BaseModel):
    numbers: list[int]
