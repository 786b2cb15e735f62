"""Keys: building and parsing are inverses, and no other text parses."""

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from shift_schemas.errors import MalformedMessage
from shift_schemas.keys import (
    ENDPOINTS,
    CommandKey,
    FactKey,
    Key,
    ReplayKey,
    ServiceKey,
    StreamKey,
    build_key,
    parse_key,
)
from shift_schemas.registry import (
    PROCEDURE_OWNER,
    SERVICES,
    STREAMS,
    SUBJECTS,
)
from support.message_strategies import HOSTILE_IDS, ids

keys = (
    st.builds(FactKey, ids, st.sampled_from(SUBJECTS))
    | st.builds(StreamKey, ids, st.sampled_from(sorted(STREAMS)))
    | st.builds(CommandKey, ids, st.sampled_from(sorted(PROCEDURE_OWNER)))
    | st.builds(ReplayKey, ids)
    | st.builds(ServiceKey, st.sampled_from(SERVICES), st.sampled_from(ENDPOINTS))
)
parts = ids | st.sampled_from(
    [
        "shift",
        "v1",
        "v2",
        "@service",
        "@replay",
        "in",
        "rpc",
        "gaze",
        "decide",
        "decider",
        "outbox",
        "*",
        "**",
        "",
        "decision",
    ]
)


@given(keys)
@example(FactKey("in", "gaze"))
@example(StreamKey("rpc", "gaze"))
@example(CommandKey("in", "decide"))
@example(FactKey("rpc", "decision"))
def test_parsing_is_the_inverse_of_building(key: Key) -> None:
    assert parse_key(build_key(key)) == key


@given(
    st.lists(parts, max_size=7).map("/".join) | st.lists(parts, max_size=4).map(lambda p: "/".join(["shift/v1", *p]))
)
def test_parsed_key_is_built_to_the_same_text(text: str) -> None:
    try:
        key = parse_key(text)
    except MalformedMessage:
        return
    assert build_key(key) == text


@given(st.text(max_size=60))
def test_any_other_text_is_not_a_key(text: str) -> None:
    with pytest.raises(MalformedMessage):
        parse_key(text)


@pytest.mark.parametrize("session", HOSTILE_IDS, ids=lambda t: ascii(t)[:20])
def test_hostile_sessions_are_neither_built_nor_parsed(session: str) -> None:
    for key in (FactKey(session, "gaze"), StreamKey(session, "gaze"), CommandKey(session, "decide")):
        with pytest.raises(MalformedMessage):
            build_key(key)
    for text in (f"shift/v1/{session}/gaze", f"shift/v1/{session}/in/gaze", f"shift/v1/{session}/rpc/decide"):
        with pytest.raises(MalformedMessage) as refused:
            parse_key(text)
        assert len(refused.value.detail) < 400, "a long key is not repeated"


@pytest.mark.parametrize(
    "key",
    [FactKey("s1", "gaze/x"), FactKey("s1", "*"), StreamKey("s1", "decision"), CommandKey("s1", "gaze"),
     ServiceKey("stranger", "health"), ServiceKey("decider", "**")],
)  # fmt: skip
def test_key_with_an_unknown_name_is_refused(key: Key) -> None:
    with pytest.raises(MalformedMessage):
        build_key(key)
