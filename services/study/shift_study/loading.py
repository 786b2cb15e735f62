"""Read a study: its text (YAML or JSON) becomes a :class:`Study`, or an error that lists its mistakes.

The error names the file, the line, the value, the rule and what to write instead.
"""

from __future__ import annotations

import json
from functools import lru_cache
from typing import Any

from pydantic import ValidationError
from shift_schemas.errors import FieldError, InvalidStudy, shorten
from shift_schemas.suggestions import did_you_mean

from shift_study.area_checks import area_mistakes
from shift_study.mistakes import MISTAKES, Lines, Mistake, mistakes_of, refusal
from shift_study.patching import merge_patch
from shift_study.prior_file import ReadBeside, read_prior_files
from shift_study.scoring_table import DEFAULT_STRATEGIES, DEFAULT_TABLE
from shift_study.shape import Path
from shift_study.study import Study
from shift_study.yaml_reader import read_yaml


def parse_study(text: str, name: str = "study", read_beside: ReadBeside | None = None) -> Study:
    """Return the study of a text in YAML or JSON; ``name`` is the file's, for the message.

    ``read_beside`` returns the text of a file beside the study, which can hold a learner's prior.

    Raises
    ------
    InvalidStudy
        With one field error per mistake; the message gives ``file:line``.
    """
    data, lines = read_yaml(text, name)
    if read_beside is not None and (found := read_prior_files(data, lines, read_beside)):
        raise refusal(name, found)
    return checked(study_of(data, name, lines), name, lines)


def given_study(data: Any, name: str = "study") -> Study:
    """Return the study of a plain object that someone gives at a start, checked like a file.

    Raises :class:`InvalidStudy` with one field error per mistake.
    """
    return checked(study_of(data, name), name, {})


def checked(study: Study, name: str, lines: Lines) -> Study:
    """Return ``study``; raise :class:`InvalidStudy` if it has an area that no gaze can hit.

    Only new studies are checked: recordings and running sessions of earlier versions have such areas.
    """
    if errors := area_mistakes(study.aois):
        raise refusal(name, [Mistake(_line_of(e, lines), e.field, e.value, e.rule) for e in errors])
    return study


def _line_of(error: FieldError, lines: Lines) -> int | None:
    path: Path = tuple(int(part) if part.isdigit() else part for part in error.field.split("."))
    return next((lines[path[:n]] for n in range(len(path), 0, -1) if path[:n] in lines), None)


def study_of(data: Any, name: str = "study", lines: Lines | None = None) -> Study:
    """Return the study of a plain object, checked as a whole and under each of its conditions."""
    study = _validated(data, name, lines or {}, ())
    found = [m for condition in study.conditions for m in _mistakes_under(study, condition, lines or {})]
    if found:
        raise refusal(name, found)
    return study


def _mistakes_under(study: Study, condition: str, lines: Lines) -> list[Mistake]:
    found = _read(_merged(study, study.conditions[condition]), lines, ("conditions", condition))
    return [] if isinstance(found, Study) else found


def study_in_force(study: Study, condition: str | None) -> Study:
    """Return the study under one of its conditions; None stands for the study's own values.

    Raises :class:`InvalidStudy` for a condition that the study does not have.
    """
    if condition is None:
        return study
    if condition not in study.conditions:
        known = ", ".join(study.conditions) or "none"
        meant = did_you_mean(condition, study.conditions)
        raise InvalidStudy(
            f"study {study.study} has no condition {condition!r}; it has {known}{meant}",
            (FieldError(field="condition", value=shorten(condition), rule=f"one of: {known}"),),
        )
    return _in_force(study, condition, study.study, {})


def patched(study: Study, patch: Any) -> Study:
    """Return the study after a JSON merge patch (RFC 7386); the caller checks whether it may change now."""
    return _validated(_merged(study, patch), "config", {}, ())


def study_data(study: Study) -> dict[str, Any]:
    """Return the study as a plain object with every default; :func:`study_of` is the inverse."""
    data: dict[str, Any] = study.model_dump(mode="json", exclude_none=True)
    strategies = data["scoring"]["strategies"]
    strategies.update({name: None for name in DEFAULT_STRATEGIES if name not in strategies})  # they stay removed
    return data


def study_json(study: Study) -> str:
    """Return the study as one JSON string, as ``config`` facts carry it."""
    return json.dumps(study_data(study), ensure_ascii=False, separators=(",", ":"))


@lru_cache(maxsize=128)
def study_from_json(text: str) -> Study:
    """Return the study of a ``config`` fact; it is cached, because every message of a session needs it."""
    return study_of(as_recorded(json.loads(text)))


def as_recorded(data: Any) -> Any:
    """Return the data of a recorded study; a value that its version did not have gets that version's rule.

    Version 0.1 had no ``attention.minimum_dwell_s``: the gaze class held from the first sample on an AOI.
    """
    if isinstance(data, dict) and isinstance(attention := data.get("attention"), dict):
        return {**data, "attention": {"minimum_dwell_s": 0.0, **attention}}
    return data


def _in_force(study: Study, condition: str, name: str, lines: Lines) -> Study:
    return _validated(_merged(study, study.conditions[condition]), name, lines, ("conditions", condition))


def _merged(study: Study, patch: Any) -> Any:
    """Return the study's data under a merge patch. A strategy set to null is removed with its column of the table."""
    merged = merge_patch(study_data(study), patch)
    for name in _removed_strategies(patch):
        scoring = merged["scoring"]
        if name in DEFAULT_STRATEGIES:
            scoring["strategies"][name] = None  # without this entry it would be the default's
        if isinstance(scoring.get("table"), dict):
            column = {part: {row: {name: None} for row in rows} for part, rows in DEFAULT_TABLE.items()}
            scoring["table"] = merge_patch(scoring["table"], column)
    return merged


def _removed_strategies(patch: Any) -> list[str]:
    for key in ("scoring", "strategies"):
        patch = patch.get(key) if isinstance(patch, dict) else None
    return [name for name, given in patch.items() if given is None] if isinstance(patch, dict) else []


def _validated(data: Any, name: str, lines: Lines, under: Path) -> Study:
    found = _read(data, lines, under)
    if isinstance(found, Study):
        return found
    raise refusal(name, found)


def _read(data: Any, lines: Lines, under: Path) -> Study | list[Mistake]:
    """Return the study of a plain object, or its mistakes."""
    try:
        return Study.model_validate_json(json.dumps(data))
    except ValidationError as e:
        return [m for found in e.errors(include_url=False)[:MISTAKES] for m in mistakes_of(found, lines, under)]
    except (RecursionError, ValueError, TypeError):
        return [Mistake(None, "", "", "it is nested too deep, or it holds a value that JSON does not have")]
