"""The scoring system H_S and the threshold ranking (paper, section III-C, Table I).

Pure. The table is data (the study's); this module adds it up and ranks the sums. It lies with the schemas and
not with the decider because learners take the suggestion as their prior, and no core imports another.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

from shift_model.vocabulary import TRIPLES, Triple
from shift_schemas.messages import TripleView

from shift_study.loading import study_from_json
from shift_study.study import ScoringSettings

MARGIN = 1e-9
"""Scores are sums of thirds: a score that equals a threshold must not fall below it by rounding."""


class Reduction(NamedTuple):
    """What the scoring system makes of one triple."""

    scores: dict[str, float]
    action: int
    cognitive_state: str


def scores(settings: ScoringSettings, triple: Triple) -> dict[str, float]:
    """Each strategy's score: its weight x the sum of the table's three entries / S_max."""
    rows = settings.table.rows(triple)
    return {
        name: strategy.weight * sum(row[name] for row in rows) / settings.s_max
        for name, strategy in settings.strategies.items()
    }


def rank(score: float, thresholds: list[float]) -> int:
    """Index of the level: how many of the rising thresholds the score reaches."""
    return sum(score >= threshold - MARGIN for threshold in thresholds)


def reduce(settings: ScoringSettings, triple: Triple) -> Reduction:
    """Scores, the suggested action's index and the cognitive state, which *is* that action."""
    found = scores(settings, triple)
    action = 0
    for name, strategy in settings.strategies.items():
        action = action * len(strategy.levels) + rank(found[name], strategy.thresholds)
    return Reduction(found, action, settings.states[action])


@lru_cache(maxsize=64)
def reductions(study: str) -> dict[Triple, Reduction]:
    """What the scoring system makes of each of the 30 triples; the study in force as ``config`` facts carry it."""
    settings = study_from_json(study).scoring
    return {triple: reduce(settings, triple) for triple in TRIPLES}


def suggestions(settings: ScoringSettings) -> tuple[int, ...]:
    """The suggested action's index for each of the 30 triples, in their order."""
    return tuple(reduce(settings, triple).action for triple in TRIPLES)


def view(triple: Triple) -> TripleView:
    """The triple as it travels."""
    return TripleView(capacity=triple.capacity, gaze=triple.gaze, awareness=triple.awareness)
