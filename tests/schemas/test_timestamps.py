"""Stamps: two integers on the wire, nanoseconds in the code."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError
from shift_schemas.timestamps import NS, Stamp


@given(st.integers(0, 2**40 * NS))
def test_nanoseconds_are_kept_on_the_wire(ns: int) -> None:
    wire = Stamp.of(ns).model_dump_json()
    assert Stamp.model_validate_json(wire).ns == ns
    assert json.loads(wire) == {"sec": ns // NS, "nsec": ns % NS}


@pytest.mark.parametrize(
    "text",
    ['{"sec":-1,"nsec":0}', '{"sec":0,"nsec":-1}', '{"sec":0,"nsec":1000000000}', '{"sec":1.5,"nsec":0}',
     '{"sec":true,"nsec":0}', '{"sec":"1","nsec":0}', '{"sec":1}', '{"sec":1,"nsec":0,"x":0}', '{"sec":1e99,"nsec":0}'],
)  # fmt: skip
def test_invalid_stamp_is_refused(text: str) -> None:
    with pytest.raises(ValidationError):
        Stamp.model_validate_json(text)
