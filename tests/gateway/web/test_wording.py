"""The words of the page."""

from __future__ import annotations

import pytest
from shift_gateway.web.wording import duration, levels, spoken
from shift_model.vocabulary import COGNITIVE_STATES


@pytest.mark.parametrize("pair", COGNITIVE_STATES)
def test_every_action_of_the_paper_is_spoken(pair: tuple[str, str]) -> None:
    strategy = {"negation": pair[0], "hesitation": pair[1]}
    assert spoken(strategy)
    assert ("“um”" in spoken(strategy)) == (pair[1] == "hesitation")
    assert levels(strategy) == ", ".join(pair)


def test_further_levels_are_shown_as_the_study_writes_them() -> None:
    assert spoken({"negation": "affirmation", "tempo": "slow"}) == "affirmation, slow"


@pytest.mark.parametrize(("seconds", "text"), [(-1, "0:00"), (9.9, "0:09"), (761, "12:41"), (3723, "1:02:03")])
def test_duration_is_minutes_and_seconds(seconds: float, text: str) -> None:
    assert duration(seconds) == text
