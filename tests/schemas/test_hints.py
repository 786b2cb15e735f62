"""What was probably meant."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shift_schemas.hints import did_you_mean, id_like, level_like, nearest
from shift_schemas.ids import is_id

TASKS = ["grasp", "turn", "pour"]


@pytest.mark.parametrize(
    ("word", "meant"), [("gasp", "grasp"), ("Grasp", "grasp"), ("TURN", "turn"), ("pours", "pour"), ("zzz", None)]
)
def test_the_nearest_name_is_found_in_either_case(word: str, meant: str | None) -> None:
    assert nearest(word, TASKS) == meant
    assert did_you_mean(word, TASKS) == (f"; did you mean {meant!r}?" if meant else "")


def test_nothing_is_meant_where_there_is_nothing() -> None:
    assert did_you_mean("x", []) == did_you_mean("", TASKS) == ""


@pytest.mark.parametrize(
    ("text", "like"),
    [("coffee cup", "coffee-cup"), ("Löffel", "Loffel"), ("Straße 7", "Strasse-7"), ("12:30", "12-30"), ("a/b", "a-b"),
     ("-x-", "x"), ("日本", ""), ("", ""), ("x" * 99, "x" * 63), ("smørbrød", "smorbrod")],
)  # fmt: skip
def test_an_id_is_made_of_any_text(text: str, like: str) -> None:
    assert id_like(text) == like


@given(st.text(max_size=300))
def test_what_is_proposed_is_an_id_or_nothing(text: str) -> None:
    assert not id_like(text) or is_id(id_like(text))


@pytest.mark.parametrize(
    ("text", "like"), [("Off", "off"), ("not at all", "not_at_all"), ("01", ""), ("2fast", "fast")]
)
def test_a_level_is_made_of_any_text(text: str, like: str) -> None:
    assert level_like(text) == like
