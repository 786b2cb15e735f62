"""Edits of the scoring table become a merge patch, and the triples that it moves are found."""

from __future__ import annotations

import pytest
from shift_gateway.web.scoring_edits import changed_states, editable, scoring_patch, value_at
from shift_schemas.errors import InvalidStudy, MalformedMessage
from shift_study.loading import patched, study_json, study_of
from shift_study.scoring import reductions

DEFAULT = study_of({"study": "default"})
CAPACITY, GAZE = ("low", "high"), ("distracted", "uncertain", "focused")
AWARENESS = ("unknown", "failure", "misconception_enabledness", "misconception_comprehension", "success")
THIRD = study_of(
    {
        "study": "third",
        "scoring": {
            "strategies": {"repetition": {"levels": ["once", "twice"], "thresholds": [0.5]}},
            "table": {
                part: {category: {"repetition": 1} for category in rows}
                for part, rows in (("capacity", CAPACITY), ("gaze", GAZE), ("awareness", AWARENESS))
            },
        },
    }
)


def test_every_weight_and_table_entry_has_an_input() -> None:
    assert len(editable(DEFAULT)) == 2 + 10 * 2
    assert len(editable(THIRD)) == 3 + 10 * 3
    assert value_at(DEFAULT, editable(DEFAULT)["table-low-hesitation"]) == 1
    assert value_at(THIRD, editable(THIRD)["strategy-weight-repetition"]) == 1


def test_patch_has_only_what_differs() -> None:
    typed = {"strategy-weight-negation": "0.5", "strategy-weight-hesitation": "1", "table-low-negation": " 1 "}
    assert scoring_patch(DEFAULT, typed) == {
        "scoring": {"strategies": {"negation": {"weight": 0.5}}, "table": {"capacity": {"low": {"negation": 1.0}}}}
    }
    assert scoring_patch(DEFAULT, {}) == {}


def test_text_that_is_no_number_is_refused_by_name() -> None:
    with pytest.raises(MalformedMessage, match="table-low-negation: write a number"):
        scoring_patch(DEFAULT, {"table-low-negation": "much"})


def test_changed_states_are_those_in_which_the_reductions_differ() -> None:
    patch = scoring_patch(DEFAULT, {"strategy-weight-negation": "0.5"})
    before, after = reductions(study_json(DEFAULT)), reductions(study_json(patched(DEFAULT, patch)))
    found = {c.triple: (c.before, c.after) for c in changed_states(DEFAULT, patch)}
    assert found == {
        t: (before[t].cognitive_state, after[t].cognitive_state)
        for t in before
        if before[t].cognitive_state != after[t].cognitive_state
    }
    assert found


def test_nothing_changes_without_an_edit() -> None:
    assert changed_states(THIRD, {}) == []


@pytest.mark.parametrize(
    "typed", [{"table-low-negation": "1.5"}, {"strategy-weight-negation": "-1"}, {"strategy-weight-negation": "nan"}]
)
def test_value_that_the_study_cannot_have_is_refused(typed: dict[str, str]) -> None:
    with pytest.raises(InvalidStudy):
        changed_states(DEFAULT, scoring_patch(DEFAULT, typed))
