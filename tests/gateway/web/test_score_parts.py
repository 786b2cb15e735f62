"""The calculation of a score equals the scoring system's."""

from __future__ import annotations

import pytest
from shift_gateway.web.score_parts import score_parts
from shift_model.vocabulary import TRIPLES
from shift_study.loading import study_of
from shift_study.scoring import reduce, view

WEIGHTED = study_of({"study": "s", "scoring": {"strategies": {"negation": {"weight": 0.7}}}}).scoring


@pytest.mark.parametrize("triple", TRIPLES, ids=lambda t: t.name)
def test_scores_and_levels_are_those_of_the_scoring_system(triple) -> None:
    found = score_parts(WEIGHTED, view(triple), {"negation": "negation", "hesitation": "none"})
    wanted = reduce(WEIGHTED, triple)
    assert {p.strategy: p.score for p in found} == wanted.scores
    assert tuple(p.suggested for p in found) == WEIGHTED.actions[wanted.action]
    assert [p.chosen for p in found] == ["negation", "none"]


def test_entries_name_the_observations() -> None:
    negation = score_parts(WEIGHTED, view(TRIPLES[0]), {})[0]
    assert [(part, word) for part, word, _ in negation.entries] == [
        ("capacity", "low"), ("gaze", "distracted"), ("awareness", "unknown"),
    ]  # fmt: skip
    assert negation.total == sum(value for _, _, value in negation.entries)
