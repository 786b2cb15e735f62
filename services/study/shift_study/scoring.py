"""The study's scoring table, applied to the 30 triples (paper, section III-C, Table I). Pure.

The arithmetic is in ``shift_model.scoring``; the table is the study's. This module is in the study's room and not in
the decider's, because learners use the suggestion as their prior and no core imports another.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

from shift_model.scoring import action_index, level_index, scaffolding_score
from shift_model.vocabulary import TRIPLES, Triple
from shift_schemas.messages import TripleView

from shift_study.loading import study_from_json
from shift_study.study import ScoringSettings


class Reduction(NamedTuple):
    """The result of the scoring system for one triple."""

    scores: dict[str, float]
    action: int
    cognitive_state: str


def scores(settings: ScoringSettings, triple: Triple) -> dict[str, float]:
    """Return each strategy's score, from the table's three entries for the triple."""
    rows = settings.table.rows(triple)
    return {
        name: scaffolding_score((row[name] for row in rows), strategy.weight, settings.s_max)
        for name, strategy in settings.strategies.items()
    }


def reduce(settings: ScoringSettings, triple: Triple) -> Reduction:
    """Return the scores, the suggested action's index and the cognitive state, which *is* that action."""
    found = scores(settings, triple)
    strategies = settings.strategies
    levels = (level_index(found[name], strategy.thresholds) for name, strategy in strategies.items())
    action = action_index(levels, (len(strategy.levels) for strategy in strategies.values()))
    return Reduction(found, action, settings.states[action])


@lru_cache(maxsize=64)
def reductions(study: str) -> dict[Triple, Reduction]:
    """Return the result for each of the 30 triples; ``study`` is the study in force as ``config`` facts carry it."""
    settings = study_from_json(study).scoring
    return {triple: reduce(settings, triple) for triple in TRIPLES}


def suggestions(settings: ScoringSettings) -> tuple[int, ...]:
    """Return the suggested action's index for each of the 30 triples, in their order."""
    return tuple(reduce(settings, triple).action for triple in TRIPLES)


def view(triple: Triple) -> TripleView:
    """Return the triple as messages carry it."""
    return TripleView(capacity=triple.capacity, gaze=triple.gaze, awareness=triple.awareness)
