"""What the page of a study shows: its table, its 30 triples, and the mistakes in an edited text. Pure."""

from __future__ import annotations

import re
from typing import Any, NamedTuple

from shift_model.vocabulary import TRIPLES
from shift_schemas.errors import InvalidStudy
from shift_study.checks import study_warnings
from shift_study.loading import parse_study
from shift_study.scoring import reduce
from shift_study.scoring_table import ScoringTable
from shift_study.study import Study

from shift_gateway.web.wording import levels

OWN_VALUES = "the study's own values"
"""The choice of no condition."""


def triple_rows(study: Study) -> list[dict[str, str]]:
    """Return a row for each of the 30 triples: its scores, the suggested strategy and the cognitive state."""
    rows = []
    for triple in TRIPLES:
        found = reduce(study.scoring, triple)
        rows.append(
            {
                "triple": triple.name,
                "scores": ", ".join(f"{name} {score:.3f}" for name, score in found.scores.items()),
                "strategy": levels(study.scoring.choices[found.action]),
                "state": found.cognitive_state,
            }
        )
    return rows


def table_rows(study: Study) -> list[dict[str, Any]]:
    """Return the scoring table: a row for each category, a column for each strategy, and the weights."""
    names = list(study.scoring.strategies)
    rows: list[dict[str, Any]] = [
        {"category": "weight", **{n: f"{study.scoring.strategies[n].weight:g}" for n in names}}
    ]
    for part in ScoringTable.model_fields:
        for category, row in getattr(study.scoring.table, part):
            rows.append({"category": f"{part}: {category}", **{n: f"{row[n]:g}" for n in names}})
    return rows


class Remark(NamedTuple):
    """One mistake or warning about a study's text."""

    line: int | None
    """The line that it is about, from 1; None for the whole text."""
    sentence: str
    is_mistake: bool


class CheckedText(NamedTuple):
    """A study's text as it was checked."""

    study: Study | None
    remarks: tuple[Remark, ...]


def checked_text(text: str, name: str) -> CheckedText:
    """Return what is wrong or doubtful in a study's text; ``name`` is the name under which it would be saved."""
    file = f"{name or 'study'}.yaml"
    try:
        study = parse_study(text, file)
    except InvalidStudy as e:
        return CheckedText(None, tuple(_remark(sentence, file) for sentence in e.sentences or (e.detail,)))
    warnings = [Remark(None, sentence, False) for sentence in study_warnings(study)]
    if name and study.study != name:
        warnings.insert(
            0, Remark(None, f"the file is {file}, and its study is {study.study}; write study: {name}", False)
        )
    return CheckedText(study, tuple(warnings))


def _remark(sentence: str, file: str) -> Remark:
    found = re.match(rf"{re.escape(file)}:(\d+): (.*)", sentence, re.DOTALL)
    return Remark(int(found[1]), found[2], True) if found else Remark(None, sentence.removeprefix(f"{file}: "), True)
