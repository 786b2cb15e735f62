"""Edits of the strategy weights and the scoring table, and the triples whose cognitive state they change. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from shift_model.vocabulary import TRIPLES, Triple
from shift_schemas.errors import FieldError, MalformedMessage
from shift_study.loading import patched
from shift_study.scoring import reduce
from shift_study.scoring_table import ScoringTable
from shift_study.study import Study

Path = tuple[str, ...]
"""The keys that lead to a value of the study."""


def editable(study: Study) -> dict[str, Path]:
    """Return the path of each value that can be edited, by the name of its input."""
    strategies = list(study.scoring.strategies)
    weights = {f"strategy-weight-{s}": ("scoring", "strategies", s, "weight") for s in strategies}
    return weights | {
        table_name(category, s): ("scoring", "table", part, category, s)
        for part, category in categories()
        for s in strategies
    }


def categories() -> list[tuple[str, str]]:
    """Return the rows of the scoring table: observation and category."""
    parts = ScoringTable.model_fields.items()
    return [(part, category) for part, info in parts for category in getattr(info.annotation, "model_fields", ())]


def table_name(category: str, strategy: str) -> str:
    """Return the name of the input of one table entry."""
    return f"table-{category}-{strategy}"


def value_at(study: Study, path: Path) -> float:
    """Return a number of the study."""
    part: Any = study
    for key in path:
        part = part[key] if isinstance(part, dict) else getattr(part, key)
    return float(part)


def number_of(name: str, typed: str) -> float:
    """Return the number that somebody typed; raise :class:`MalformedMessage` if it is none."""
    try:
        return float(typed.strip())
    except ValueError:
        rule = "write a number with a decimal point, such as 0.5"
        raise MalformedMessage(f"{name}: {rule}", (FieldError(field=name, value=typed[:40], rule=rule),)) from None


def scoring_patch(study: Study, typed: Mapping[str, str]) -> dict[str, Any]:
    """Return the merge patch with the values that differ from the study's, by what the inputs contain.

    Raises :class:`MalformedMessage` for a text that is not a number.
    """
    paths = editable(study)
    given = {paths[name]: number_of(name, text) for name, text in typed.items() if name in paths}
    return nested({path: value for path, value in given.items() if value != value_at(study, path)})


def nested(values: Mapping[Path, Any]) -> dict[str, Any]:
    """Return a merge patch that sets the values at their paths."""
    patch: dict[str, Any] = {}
    for path, value in values.items():
        part = patch
        for key in path[:-1]:
            part = part.setdefault(key, {})
        part[path[-1]] = value
    return patch


class StateChange(NamedTuple):
    """A triple whose cognitive state would be another one."""

    triple: Triple
    before: str
    after: str


def changed_states(study: Study, patch: Mapping[str, Any]) -> list[StateChange]:
    """Return the triples whose cognitive state a merge patch would change.

    Raises :class:`shift_schemas.errors.InvalidStudy` for a value that the study cannot have.
    """
    after = patched(study, dict(patch)).scoring
    pairs = ((t, reduce(study.scoring, t).cognitive_state, reduce(after, t).cognitive_state) for t in TRIPLES)
    return [StateChange(t, old, new) for t, old, new in pairs if old != new]
