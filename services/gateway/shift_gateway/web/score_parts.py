"""How each entry of the scoring table contributed to each strategy's score (paper, section III-C, Table I). Pure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from shift_model.scoring import level_index, scaffolding_score
from shift_model.vocabulary import Triple
from shift_schemas.messages import TripleView
from shift_study.scoring_table import ScoringSettings


class ScoreParts(NamedTuple):
    """The calculation of one strategy's score: ``weight`` x ``total`` / ``s_max``, ranked by the thresholds."""

    strategy: str
    entries: tuple[tuple[str, str, float], ...]
    """Observation, its category, and the table's entry: capacity, gaze and awareness."""
    total: float
    weight: float
    s_max: float
    score: float
    thresholds: tuple[float, ...]
    suggested: str
    """The level that the score is ranked into."""
    chosen: str
    """The level of the decision; '' is no decision."""


def score_parts(settings: ScoringSettings, observed: TripleView, chosen: Mapping[str, str]) -> tuple[ScoreParts, ...]:
    """Return the calculation for each strategy, in the study's order."""
    rows = settings.table.rows(Triple(observed.capacity, observed.gaze, observed.awareness))
    names = (("capacity", observed.capacity), ("gaze", observed.gaze), ("awareness", observed.awareness))
    found = []
    for name, strategy in settings.strategies.items():
        entries = tuple((part, word, row[name]) for (part, word), row in zip(names, rows, strict=True))
        values = [value for _, _, value in entries]
        score = scaffolding_score(values, strategy.weight, settings.s_max)
        found.append(
            ScoreParts(
                name, entries, sum(values), strategy.weight, settings.s_max, score, tuple(strategy.thresholds),
                strategy.levels[level_index(score, strategy.thresholds)], chosen.get(name, ""),
            )
        )  # fmt: skip
    return tuple(found)
