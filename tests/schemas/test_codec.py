"""Payloads: any payload is either decoded or refused as malformed."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import BaseModel
from shift_schemas.codec import decode, encode, encode_answer, encoding_of
from shift_schemas.errors import MalformedMessage
from shift_schemas.messages import Answer, Configure, Decide, Decision, GazeChunk, OutboxQuery
from shift_schemas.registry import COMMANDS, FACTS
from support.message_strategies import json_values

KINDS: list[type[BaseModel]] = [*FACTS.values(), *COMMANDS.values(), GazeChunk, OutboxQuery, Answer]
DECIDE = '{"command_id":"d1","session":"s1","task":"grasp"}'
CONFIGURE = '{"command_id":"c","session":"s1","patch":'
CHUNK = '{"source":"a","seq":%s,"t":%s,"x":%s,"y":[0.5],"valid":[true]}'


def test_encodings_name_the_message_and_its_version() -> None:
    assert encoding_of(GazeChunk) == "application/json;shift.GazeChunk.v1"
    assert encoding_of(Decision) == "application/json;shift.Decision.v1"


def test_decoding_is_the_inverse_of_encoding() -> None:
    message = decode(Decide, DECIDE)
    assert decode(Decide, encode(message)) == message


@pytest.mark.parametrize("result", [{}, {"n": 7, "reason": "größer als {}"}, {"of": {"a": [{}]}}])
@pytest.mark.parametrize("repeat", [True, False])
def test_answer_with_an_encoded_result_decodes_to_that_answer(result: dict[str, object], repeat: bool) -> None:
    payload = encode_answer("decider", 3, repeat, json.dumps(result))
    assert decode(Answer, payload) == Answer(owner="decider", seq=3, repeat=repeat, result=result)


@pytest.mark.parametrize("number", ["NaN", "Infinity", "-Infinity", "1e999", "-1e999", "true", "false", '"0.5"', "[]"])
def test_number_that_is_not_finite_is_refused(number: str) -> None:
    for text in (
        CHUNK % (0, f"[{number}]", "[0.5]"),
        CHUNK % (0, "[0]", f"[{number}]"),
        CHUNK % (number, "[0]", "[0]"),
    ):
        with pytest.raises(MalformedMessage):
            decode(GazeChunk, text)
    for patch in ('{"a": %s}', '{"a": [%s]}', '{"a": {"b": [{"c": %s}]}}'):
        if number in ("NaN", "Infinity", "-Infinity", "1e999", "-1e999"):
            with pytest.raises(MalformedMessage):
                decode(Configure, CONFIGURE + patch % number + "}")


@pytest.mark.parametrize(
    "payload",
    [b"", b"{", b"null", b"[]", b'"x"', b"0", b"\xff\xfe", b"\x00", b"[" * 100_000, b'{"a":' * 100_000,
     b'{"task":' + b"9" * 100_000 + b"}", DECIDE.encode()[:-1], DECIDE.encode() + b"x",
     DECIDE.replace("}", ',"x":1}').encode(),
     DECIDE.replace('"grasp"', "1").encode(), DECIDE.replace('"grasp"', '"\\ud800"').encode(),
     DECIDE.replace("grasp", "g" * 70_000).encode(), DECIDE.replace("d1", "../x").encode(), DECIDE.encode("utf-16")],
    ids=lambda p: ascii(p[:16]),
)  # fmt: skip
def test_nonsense_is_malformed_and_the_error_stays_short(payload: bytes) -> None:
    with pytest.raises(MalformedMessage) as refused:
        decode(Decide, payload)
    assert len(refused.value.detail) < 500
    assert all(len(e.field) <= 80 and len(e.value) <= 80 for e in refused.value.errors)


@pytest.mark.parametrize("depth", [40, 200, 500])
def test_patch_that_is_nested_too_deep_is_refused(depth: int) -> None:
    for patch in ('{"a":' * depth + "1" + "}" * depth, '{"a":' + "[" * depth + "]" * depth + "}"):
        with pytest.raises(MalformedMessage):
            decode(Configure, CONFIGURE + patch + "}")


@given(st.sampled_from(KINDS), st.binary(max_size=200) | json_values.map(json.dumps))
def test_any_payload_is_decoded_or_malformed(kind: type[BaseModel], payload: bytes | str) -> None:
    try:
        message = decode(kind, payload)
    except MalformedMessage:
        return
    assert decode(kind, encode(message)) == message


@given(st.sampled_from(["task", "command_id", "session", "need"]), json_values)
def test_field_of_any_type_is_accepted_or_malformed(field: str, value: object) -> None:
    try:
        message = decode(Decide, json.dumps(json.loads(DECIDE) | {field: value}))
    except MalformedMessage:
        return
    assert decode(Decide, encode(message)) == message
