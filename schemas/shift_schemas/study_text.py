"""From a study's text (YAML or JSON) to a :class:`Study`, and mistakes to sentences.

A mistake gives file, line, the value, the rule and what to write instead.
"""

from __future__ import annotations

import difflib
import json
from collections.abc import Iterator
from functools import lru_cache
from typing import Any

import yaml
from pydantic import BaseModel, ValidationError

from shift_schemas.errors import FieldError, InvalidStudy, shorten
from shift_schemas.study import DEFAULT_STRATEGIES, Study, merge_patch

Path = tuple[str | int, ...]
Lines = dict[Path, int]


def parse_study(text: str, name: str = "study") -> Study:
    """The study that ``text`` spells, YAML or JSON; ``name`` is the file's, for the message.

    Raises
    ------
    InvalidStudy
        With one field error per mistake; the message gives ``file:line``.
    """
    try:
        node = yaml.compose(text, Loader=yaml.SafeLoader)
    except (yaml.YAMLError, RecursionError) as e:
        mark = getattr(e, "problem_mark", None)
        where = f"{name}:{mark.line + 1}" if mark else name
        raise InvalidStudy(
            f"{where}: this is not YAML: {getattr(e, 'problem', None) or 'it is nested too deep'}"
        ) from e
    if not isinstance(node, yaml.MappingNode):
        raise InvalidStudy(f"{name}:1: a study is a mapping; begin with 'study: my-study'")
    lines: Lines = {}
    for path, line, twice in _walk(node, (), 0):
        if twice:
            raise InvalidStudy(f"{name}:{line}: {_dotted(path)} is given twice; keep one of the two")
        lines[path] = line
    return study_of(yaml.safe_load(text), name, lines)


def study_of(data: Any, name: str = "study", lines: Lines | None = None) -> Study:
    """The study of a plain object, checked as a whole and under each of its conditions."""
    study = _validated(data, name, lines or {}, ())
    for condition in study.conditions:
        _in_force(study, condition, name, lines or {})
    return study


def study_in_force(study: Study, condition: str | None) -> Study:
    """The study under one of its conditions; ``None`` is the study's own values.

    Raises :class:`InvalidStudy` for a condition that the study does not have.
    """
    if condition is None:
        return study
    if condition not in study.conditions:
        known = ", ".join(study.conditions) or "none"
        raise InvalidStudy(
            f"study {study.study} has no condition {condition!r}; it has {known}",
            (FieldError(field="condition", value=shorten(condition), rule=f"one of: {known}"),),
        )
    return _in_force(study, condition, study.study, {})


def patched(study: Study, patch: Any) -> Study:
    """The study after a JSON merge patch (RFC 7386), whether or not it may change now."""
    return _validated(merge_patch(study_data(study), patch), "config", {}, ())


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
    return study_of(json.loads(text))


def _in_force(study: Study, condition: str, name: str, lines: Lines) -> Study:
    merged = merge_patch(study_data(study), study.conditions[condition])
    return _validated(merged, name, lines, ("conditions", condition))


def _validated(data: Any, name: str, lines: Lines, under: Path) -> Study:
    try:
        return Study.model_validate_json(json.dumps(data, default=str))
    except ValidationError as e:
        mistakes = [_mistake(found, lines, under) for found in e.errors(include_url=False)[:20]]
        said = "; ".join(
            f"{name}:{line}: {f.field}: {f.rule}" if line else f"{name}: {f.field}: {f.rule}" for line, f in mistakes
        )
        raise InvalidStudy(said, tuple(f for _, f in mistakes)) from e
    except (RecursionError, ValueError) as e:
        raise InvalidStudy(f"{name}: it is nested too deep or holds what JSON cannot say") from e


def _mistake(found: Any, lines: Lines, under: Path) -> tuple[int | None, FieldError]:
    path: Path = tuple(p for p in found["loc"] if p != "[key]")
    line = next(
        (
            lines[p]
            for start in (under, ())
            for n in range(len(path), -1, -1)
            if (p := (*start, *path[:n])) in lines and p
        ),
        lines.get((), None),
    )
    value = "" if found["type"] == "missing" else shorten(found["input"])
    return line, FieldError(field=_dotted(path) or "study", value=value, rule=_rule(found, path, value))


def _rule(found: Any, path: Path, value: str) -> str:
    message = str(found["msg"]).removeprefix("Value error, ")
    if found["type"] == "extra_forbidden":
        known = sorted(_fields_at(path[:-1]))
        near = difflib.get_close_matches(str(path[-1]), known, n=1)
        meant = f"write {near[0]!r}" if near else f"write one of {', '.join(known)}"
        return f"{str(path[-1])!r} is no key here; {meant}"
    if found["type"] == "missing":
        return "it is missing; write it"
    if found["type"] == "value_error":
        return message
    default = _default_at(path)
    instead = "" if default is None else f"; write for example the default, {json.dumps(default)}"
    return f"{value!r} does not do: {message[0].lower()}{message[1:]}{instead}"


def _fields_at(path: Path) -> Iterator[str]:
    here: Any = Study
    for part in path:
        field = here.model_fields.get(str(part)) if isinstance(here, type) and issubclass(here, BaseModel) else None
        here = _model_in(field.annotation) if field else None
    if isinstance(here, type) and issubclass(here, BaseModel):
        yield from here.model_fields


def _model_in(annotation: Any) -> Any:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next((m for a in getattr(annotation, "__args__", ()) if (m := _model_in(a))), None)


_DEFAULTS: dict[str, Any] = {}


def _default_at(path: Path) -> Any:
    here: Any = _DEFAULTS or _DEFAULTS.update(study_data(Study(study="default"))) or _DEFAULTS
    for part in path:
        try:
            here = here[part]
        except (KeyError, IndexError, TypeError):
            return None
    return None if isinstance(here, dict) else here


def _walk(node: yaml.Node, path: Path, depth: int) -> Iterator[tuple[Path, int, bool]]:
    if depth > 32:
        return
    yield path, node.start_mark.line + 1, False
    if isinstance(node, yaml.MappingNode):
        seen = set()
        for key, value in node.value:
            yield (*path, key.value), key.start_mark.line + 1, key.value in seen
            seen.add(key.value)
            yield from ((p, n, t) for p, n, t in _walk(value, (*path, key.value), depth + 1) if p != (*path, key.value))
    elif isinstance(node, yaml.SequenceNode):
        for i, value in enumerate(node.value):
            yield from _walk(value, (*path, i), depth + 1)


def _dotted(path: Path) -> str:
    return ".".join(map(str, path))
