"""Strict JSON: what only Python accepts is refused."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shift_schemas.codec import decode
from shift_schemas.errors import MalformedMessage
from shift_schemas.requests import PatchBody, StartBody
from shift_schemas.strict_json import parse_json
from support.message_strategies import json_values


@pytest.mark.parametrize(
    ("text", "says"),
    [('{"a":1,"a":2}', "a key is given twice"), ('{"b":[{"a":1,"a":1}]}', "a key is given twice"),
     ("NaN", "NaN is not a number"), ('{"a":Infinity}', "Infinity is not a number"), ("[-Infinity]", "-Infinity"),
     ('{"a":1e999}', "a number must be finite"), ("[-1e400]", "must be finite"), ("", "must be JSON"),
     ("{", "must be JSON"), ("[" * 100_000, "must be JSON"), ("9" * 10_000, "must be JSON"),
     ("{'a':1}", "must be JSON"),
     ('"\n"', "must be JSON"), ('{"a":1}x', "must be JSON"), ("// 1\n1", "must be JSON"), ("[1,]", "must be JSON")],
)  # fmt: skip
def test_json_that_only_python_accepts_is_refused_with_the_rule(text: str, says: str) -> None:
    with pytest.raises(MalformedMessage, match=says) as refused:
        parse_json(text)
    assert [e.field for e in refused.value.errors] == ["body"]


@given(json_values.filter(lambda v: "inf" not in repr(v) and "nan" not in repr(v)))
def test_strict_json_is_read_as_python_reads_it(value: object) -> None:
    text = json.dumps(value)
    assert parse_json(text) == parse_json(text.encode()) == json.loads(text)


@given(st.binary(max_size=100))
def test_any_bytes_are_json_or_malformed(raw: bytes) -> None:
    try:
        parse_json(raw)
    except MalformedMessage:
        return


@pytest.mark.parametrize("value", ["1e999", "NaN", '"\\ud800"', "[" * 40 + "]" * 40])
def test_study_or_patch_that_is_not_json_is_refused(value: str) -> None:
    with pytest.raises(MalformedMessage):
        decode(StartBody, '{"participant":"P01","study":{"study":"x","title":%s}}' % value)  # noqa: UP031
    with pytest.raises(MalformedMessage):
        decode(PatchBody, '{"title":%s}' % value)  # noqa: UP031


def test_patch_that_is_not_an_object_is_refused() -> None:
    for text in ("[]", "1", "null", '"x"'):
        with pytest.raises(MalformedMessage):
            decode(PatchBody, text)
    assert decode(PatchBody, '{"a":{"b":null}}').root == {"a": {"b": None}}


def test_study_that_is_neither_name_nor_object_is_refused_by_field() -> None:
    with pytest.raises(MalformedMessage) as refused:
        decode(StartBody, '{"participant":"P01","study":7}')
    assert {e.field for e in refused.value.errors} == {"study"}
