"""From a study's text (YAML or JSON) to a :class:`Study`, and mistakes to sentences.

A mistake gives file, line, the value, the rule and what to write instead.
"""

from __future__ import annotations

import difflib
import json
import re
from collections.abc import Iterator
from functools import lru_cache
from itertools import islice
from typing import Any, get_args, get_origin

import yaml
from pydantic import BaseModel, ValidationError

from shift_schemas.errors import FieldError, InvalidStudy, id_mistake, shorten
from shift_schemas.study import DEFAULT_STRATEGIES, DEFAULT_TABLE, Study, merge_patch

Path = tuple[str | int, ...]
Lines = dict[Path, int]
LARGEST = 50_000
"""Entries of a study file, aliases counted each time: a few lines of YAML can spell billions of them."""
RULE_LENGTH = 400
"""How much of a rule is said: rules name what is there, and that can be as long as what was sent."""


class _Loader(yaml.SafeLoader):
    """YAML 1.1's safe loader, and numbers as JSON writes them: 1e-05 has no point."""


_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float", re.compile(r"[-+]?[0-9]+(?:\.[0-9]*)?[eE][-+]?[0-9]+\Z"), list("-+0123456789")
)


def parse_study(text: str, name: str = "study") -> Study:
    """The study that ``text`` spells, YAML or JSON; ``name`` is the file's, for the message.

    Raises
    ------
    InvalidStudy
        With one field error per mistake; the message gives ``file:line``.
    """
    try:
        node = yaml.compose(text, Loader=_Loader)
    except (yaml.YAMLError, RecursionError) as e:
        mark = getattr(e, "problem_mark", None)
        where = f"{name}:{mark.line + 1}" if mark else name
        raise InvalidStudy(f"{where}: this is not YAML: {_problem_of(e) or 'it is nested too deep'}") from e
    if not isinstance(node, yaml.MappingNode):
        raise InvalidStudy(f"{name}:1: a study is a mapping; begin with 'study: my-study'")
    lines: Lines = {}
    for path, line, twice in islice(_walk(node, (), 0), LARGEST + 1):
        if twice:
            raise InvalidStudy(f"{name}:{line}: {_dotted(path)} is given twice; keep one of the two")
        lines[path] = line
    if len(lines) > LARGEST:
        raise InvalidStudy(
            f"{name}: it has more than {LARGEST} entries, aliases counted each time; write a smaller one"
        )
    return study_of(_constructed(text, name), name, lines)


def _constructed(text: str, name: str) -> Any:
    try:
        return yaml.load(text, Loader=_Loader)
    except (yaml.YAMLError, ValueError, RecursionError) as e:  # ValueError: the 99th of a month
        mark = getattr(e, "problem_mark", None)
        where = f"{name}:{mark.line + 1}" if mark else name
        raise InvalidStudy(f"{where}: {_problem_of(e) or e}; write plain text and numbers") from e


def _problem_of(error: Exception) -> str:
    return getattr(error, "problem", None) or getattr(error, "reason", None) or ""


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
    return study_of(json.loads(text))


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
    path: Path = tuple(p for p in found["loc"] if p != "[key]") or _named_first(found["msg"], lines)
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
    rule = _rule(found, path, value)
    rule = rule if len(rule) <= RULE_LENGTH else rule[: RULE_LENGTH - 1] + "…"
    return line, FieldError(field=shorten(_dotted(path)) or "study", value=value, rule=rule)


def _named_first(message: str, lines: Lines) -> Path:
    """A mistake in how parts fit together is the whole study's; its message begins with the part to change."""
    path = tuple(message.removeprefix("Value error, ").split(" ", 1)[0].split("."))
    return path if path in lines else ()


def _rule(found: Any, path: Path, value: str) -> str:
    message = str(found["msg"]).removeprefix("Value error, ")
    if found["type"] == "extra_forbidden":
        known = sorted(_fields_at(path[:-1]))
        near = difflib.get_close_matches(str(path[-1]), known, n=1)
        meant = f"write {near[0]!r}" if near else f"write one of {', '.join(known)}"
        return f"{shorten(str(path[-1]))!r} is no key here; {meant}"
    if (wrong_id := id_mistake(found)) is not None:
        return wrong_id
    if found["type"] == "missing":
        return "it is missing; write it"
    if found["type"] == "value_error":
        return message if isinstance(found["input"], dict) else f"{value} does not do: {message}"
    default = _default_at(path)
    instead = "" if default is None else f"; write for example the default, {json.dumps(default)}"
    return f"{value!r} does not do: {message[0].lower()}{message[1:]}{instead}"


def _fields_at(path: Path) -> Iterator[str]:
    here: Any = Study
    for part in path:
        here = _inside(here, part)
    if isinstance(here, type) and issubclass(here, BaseModel):
        yield from here.model_fields


def _inside(annotation: Any, part: str | int) -> Any:
    """The annotation of what stands at ``part`` of a model, list or mapping."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        field = annotation.model_fields.get(str(part))
        return field.annotation if field else None
    if get_origin(annotation) in (dict, list):
        return get_args(annotation)[-1]
    return next((found for a in get_args(annotation) if (found := _inside(a, part))), None)


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
            name = str(key.value)  # a key can be a list
            yield (*path, name), key.start_mark.line + 1, name in seen
            seen.add(name)
            yield from ((p, n, t) for p, n, t in _walk(value, (*path, name), depth + 1) if p != (*path, name))
    elif isinstance(node, yaml.SequenceNode):
        for i, value in enumerate(node.value):
            yield from _walk(value, (*path, i), depth + 1)


def _dotted(path: Path) -> str:
    return ".".join(map(str, path))
