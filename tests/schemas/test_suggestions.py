"""Suggestions for mistyped names."""

from __future__ import annotations

import pytest
from shift_schemas.suggestions import did_you_mean, level_like, nearest

TASKS = ["grasp", "turn", "pour"]


@pytest.mark.parametrize(
    ("word", "meant"), [("gasp", "grasp"), ("Grasp", "grasp"), ("TURN", "turn"), ("pours", "pour"), ("zzz", None)]
)
def test_nearest_name_is_found_in_either_case(word: str, meant: str | None) -> None:
    assert nearest(word, TASKS) == meant
    assert did_you_mean(word, TASKS) == (f"; did you mean {meant!r}?" if meant else "")


def test_no_name_is_suggested_without_a_resemblance() -> None:
    assert did_you_mean("x", []) == did_you_mean("", TASKS) == ""


@pytest.mark.parametrize(
    ("text", "like"), [("Off", "off"), ("not at all", "not_at_all"), ("01", ""), ("2fast", "fast")]
)
def test_level_is_derived_from_any_text(text: str, like: str) -> None:
    assert level_like(text) == like
