"""From a study's text (YAML or JSON) to a :class:`Study`, and mistakes to sentences.

A mistake gives file, line, the value, the rule and what to write instead.
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
from shift_study.scoring_table import DEFAULT_STRATEGIES, DEFAULT_TABLE
from shift_study.shape import Path
from shift_study.study import Study
from shift_study.yaml_reader import read_yaml


def parse_study(text: str, name: str = "study") -> Study:
    """Return the study that ``text`` spells, YAML or JSON; ``name`` is the file's, for the message.

    Raises
    ------
    InvalidStudy
        With one field error per mistake; the message gives ``file:line``.
    """
    data, lines = read_yaml(text, name)
    return checked(study_of(data, name, lines), name, lines)


def given_study(data: Any, name: str = "study") -> Study:
    """Return the study of a plain object that someone gives at a start, checked like a file.

    Raises :class:`InvalidStudy` with one field error per mistake.
    """
    return checked(study_of(data, name), name, {})


def checked(study: Study, name: str, lines: Lines) -> Study:
    """Return ``study``; raise :class:`InvalidStudy` if it has an area that no gaze can hit.

    Only what is new is checked so: recordings and running sessions of earlier versions have such areas.
    """
    if errors := area_mistakes(study.aois):
        raise refusal(name, [Mistake(_line_of(e, lines), e.field, e.value, e.rule) for e in errors])
    return study


def _line_of(error: FieldError, lines: Lines) -> int | None:
    path: Path = tuple(int(part) if part.isdigit() else part for part in error.field.split("."))
    return next((lines[path[:n]] for n in range(len(path), 0, -1) if path[:n] in lines), None)


def study_of(data: Any, name: str = "study", lines: Lines | None = None) -> Study:
    """The study of a plain object, checked as a whole and under each of its conditions."""
    study = _validated(data, name, lines or {}, ())
    found = [m for condition in study.conditions for m in _mistakes_under(study, condition, lines or {})]
    if found:
        raise refusal(name, found)
    return study


def _mistakes_under(study: Study, condition: str, lines: Lines) -> list[Mistake]:
    found = _read(_merged(study, study.conditions[condition]), lines, ("conditions", condition))
    return [] if isinstance(found, Study) else found


def study_in_force(study: Study, condition: str | None) -> Study:
    """The study under one of its conditions; ``None`` is the study's own values.

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
    """The study after a JSON merge patch (RFC 7386), whether or not it may change now."""
    return _validated(_merged(study, patch), "config", {}, ())


def study_data(study: Study) -> dict[str, Any]:
    """The study as a plain object, every default written out; ``study_of`` takes it back."""
    data: dict[str, Any] = study.model_dump(mode="json", exclude_none=True)
    strategies = data["scoring"]["strategies"]
    strategies.update({name: None for name in DEFAULT_STRATEGIES if name not in strategies})  # stay taken out
    return data


def study_json(study: Study) -> str:
    """The study as one JSON string, as ``config`` facts carry it."""
    return json.dumps(study_data(study), ensure_ascii=False, separators=(",", ":"))


@lru_cache(maxsize=128)
def study_from_json(text: str) -> Study:
    """The inverse of :func:`study_json`, remembered: a study in force is read at every message of its session."""
    return study_of(as_recorded(json.loads(text)))


def as_recorded(data: Any) -> Any:
    """Return a study that was written out whole, with the rules of its time where it lacks a value of today.

    Version 0.1 had no ``attention.minimum_dwell_s``: the gaze class held from the first sample on an AOI.
    """
    if isinstance(data, dict) and isinstance(attention := data.get("attention"), dict):
        return {**data, "attention": {"minimum_dwell_s": 0.0, **attention}}
    return data


def _in_force(study: Study, condition: str, name: str, lines: Lines) -> Study:
    return _validated(_merged(study, study.conditions[condition]), name, lines, ("conditions", condition))


def _merged(study: Study, patch: Any) -> Any:
    """The study's data under a merge patch. A strategy set to null is taken out, with its column of the table."""
    merged = merge_patch(study_data(study), patch)
    for name in _taken_out(patch):
        scoring = merged["scoring"]
        if name in DEFAULT_STRATEGIES:
            scoring["strategies"][name] = None  # left out, it would be the default's
        if isinstance(scoring.get("table"), dict):
            column = {part: {row: {name: None} for row in rows} for part, rows in DEFAULT_TABLE.items()}
            scoring["table"] = merge_patch(scoring["table"], column)
    return merged


def _taken_out(patch: Any) -> list[str]:
    for key in ("scoring", "strategies"):
        patch = patch.get(key) if isinstance(patch, dict) else None
    return [name for name, given in patch.items() if given is None] if isinstance(patch, dict) else []


def _validated(data: Any, name: str, lines: Lines, under: Path) -> Study:
    found = _read(data, lines, under)
    if isinstance(found, Study):
        return found
    raise refusal(name, found)


def _read(data: Any, lines: Lines, under: Path) -> Study | list[Mistake]:
    """The study of a plain object, or what is wrong with it."""
    try:
        return Study.model_validate_json(json.dumps(data))
    except ValidationError as e:
        return [m for found in e.errors(include_url=False)[:MISTAKES] for m in mistakes_of(found, lines, under)]
    except (RecursionError, ValueError, TypeError):
        return [Mistake(None, "", "", "it is nested too deep or holds what JSON cannot say")]
