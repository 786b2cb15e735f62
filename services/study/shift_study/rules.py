"""Sentences for what is wrong with a value in a study: the rule, and what to write instead. Pure."""

from __future__ import annotations

import json
import re
from typing import Any, get_args

from shift_schemas.errors import shorten
from shift_schemas.ids import ID_PATTERN, ID_RULE, propose_id
from shift_schemas.suggestions import did_you_mean, level_like, nearest

from shift_study.shape import CONDITIONS, Path, annotation_at, default_at, keys_at, kind_at
from shift_study.units import converted, unit_of
from shift_study.yaml_numbers import core_number

LEVEL_RULE = "1 to 32 lower-case letters, digits and _, beginning with a letter"


def rule_of(found: Any, path: Path, value: str) -> str:
    """Return the sentence for one error of pydantic at ``path``: the rule, and what to write instead."""
    kind, given = found["type"], found["input"]
    if kind == "missing":
        return "it is missing; write it"
    if kind == "extra_forbidden":
        return _key_rule(path, given)
    if kind == "value_error":
        message = str(found["msg"]).removeprefix("Value error, ")
        return message if isinstance(given, dict) else f"{value} is not valid: {message}"
    if kind == "string_pattern_mismatch":
        return _word_rule(found["ctx"]["pattern"], given)
    if kind == "literal_error":
        choices = get_args(annotation_at(path))
        return f"{value!r} is not valid; write one of {', '.join(choices)}{did_you_mean(given, choices)}"
    return f"{value!r} is not valid: {_plain_rule(found, path, given)}"


def _plain_rule(found: Any, path: Path, given: Any) -> str:
    expected = kind_at(path)
    if expected == "number" and isinstance(given, str):
        return _number_rule(given, path)
    if expected == "boolean":
        return _boolean_rule(given)
    if expected == "text" and _is_number(given):
        return f"it is not text; write {json.dumps(str(given))} in quotes"
    if expected == "text" and not isinstance(given, str):
        return "write a word or a text"
    if found["type"] in ("int_type", "int_from_float") and isinstance(given, float) and given.is_integer():
        return f"it must be a whole number; write {int(given)}"
    if expected == "list" and not isinstance(given, list):
        return _list_rule(path, given)
    if found["type"] in ("model_type", "model_attributes_type", "dict_type"):
        return _mapping_rule(path, given)
    if found["type"] in ("too_long", "too_short"):
        return _length_rule(found, path)
    return _range_rule(found, path, given)


def _key_rule(path: Path, given: Any) -> str:
    key, known = str(path[-1]), keys_at(path[:-1])
    said = f"{shorten(key)!r} is not a key here"
    if unit := converted(key, given, known):
        return f"{said}; {unit}"
    near = nearest(key, known)
    if near is None:
        return f"{said}; write one of {', '.join(known)}"
    return f"{said}; write {near!r}" + (f", in {unit_of(near)}" if unit_of(near) else "")


def _word_rule(pattern: str, given: str) -> str:
    rule, like = (ID_RULE, propose_id) if pattern == ID_PATTERN else (LEVEL_RULE, level_like)
    what = "an id" if pattern == ID_PATTERN else "a level or strategy name"
    proposal = f"; write for example {like(given)!r}" if like(given) else ""
    return f"{shorten(given)!r} is not {what}: {rule}{proposal}"


def _number_rule(text: str, path: Path) -> str:
    """Return the rule for ``text`` in the place of a number."""
    bare = text.strip().replace("−", "-")
    if core_number(bare) is not None:
        return f"it is text and a number is expected; write {bare} without quotes"
    if found := re.fullmatch(r"([-+]?[0-9.,]+)\s*%", bare):
        share = _point(found[1])
        return f"write the share of one without the sign, {share / 100:g}" if share is not None else _NUMBER
    if (joined := core_number(bare.replace("_", ""))) is not None:
        return f"a number has no _; write {joined}"
    if found := re.fullmatch(r"([0-9]+(?:\.[0-9]+)?)\s*/\s*([0-9]+)", bare):
        return f"a fraction is written out; write {float(found[1]) / (int(found[2]) or 1):.6g}"
    if re.fullmatch(r"[-+]?[0-9]+,[0-9]+", bare):
        return f"a number has a point, not a comma; write {bare.replace(',', '.')}"
    if re.fullmatch(r"[0-9]+(:[0-9]+)+", bare):
        return f"a number has no colon; write one number{_in_unit(path)}"
    if found := re.fullmatch(r"([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?)\s*([A-Za-zµ°]+)", bare):
        return f"write the number alone, {found[1]}{_in_unit(path)}"
    return _NUMBER + _default(path)


_NUMBER = "a number is expected"


def _in_unit(path: Path) -> str:
    unit = unit_of(str(path[-1])) if path else None
    return f", in {unit}" if unit else ""


def _point(text: str) -> float | None:
    number = core_number(text.replace(",", "."))
    return None if number is None else float(number)


_TRUE, _FALSE = {"true", "yes", "on", "y", "1"}, {"false", "no", "off", "n", "0"}


def _boolean_rule(given: Any) -> str:
    word = str(given).strip().lower()
    if word in _TRUE | _FALSE:
        return f"write {'true' if word in _TRUE else 'false'}, without quotes"
    return "write true or false"


def _is_number(given: Any) -> bool:
    return isinstance(given, (int, float)) and not isinstance(given, bool)


def _list_rule(path: Path, given: Any) -> str:
    if path[-1:] == ("aois",) and isinstance(given, dict):
        name = next(iter(given), "cup")
        return f"it is a list; write - {{name: {shorten(str(name))}, rectangle: [left, top, right, bottom]}}"
    item = f"[{given}]" if isinstance(given, (str, int, float)) and len(str(given)) < 60 else "[first, second]"
    return f"it is a list; write {item}"


def _mapping_rule(path: Path, given: Any) -> str:
    if len(path) == 2 and path[0] == "aois":
        name = shorten(given) if isinstance(given, str) else "cup"
        return f"an area has a name and a shape; write {{name: {name}, rectangle: [left, top, right, bottom]}}"
    known = keys_at(path)
    return "it has entries of its own; write " + (
        f"{{{known[0]}: ...}}, of {', '.join(known)}" if known else "{key: value}"
    )


_SHAPES = {
    "rectangle": "left, top, right, bottom",
    "polygon": "the corners, [x, y] each",
}


def _length_rule(found: Any, path: Path) -> str:
    context = found["ctx"]
    least, most = context.get("min_length"), context.get("max_length")
    shape = next((p for p in reversed(path) if p in _SHAPES), None)
    fixed = {"rectangle": 4, "polygon": 2 if isinstance(path[-1], int) else None}.get(str(shape)) if shape else None
    bound = str(fixed or "") or (f"at least {least}" if least is not None else f"at most {most}")
    said = f"it has {context['actual_length']} entries and needs {bound}"
    if shape is not None:
        corner = shape == "polygon" and isinstance(path[-1], int)
        return f"{said}: {'x, y' if corner else _SHAPES[str(shape)]}; write decimals with a point, 0.5 and not 0,5"
    return f"{said}; write more, or remove the key" if least is not None else f"{said}; write fewer"


_BOUNDS = {"greater_than_equal": ("ge", "at least"), "greater_than": ("gt", "above"),
           "less_than_equal": ("le", "at most"), "less_than": ("lt", "below")}  # fmt: skip


def _range_rule(found: Any, path: Path, given: Any) -> str:
    if found["type"] in _BOUNDS:
        key, words = _BOUNDS[found["type"]]
        said = f"it must be {words} {found['ctx'][key]:g}"
        if found["ctx"][key] == 1 and _is_number(given):
            return f"{said}; {_share_rule(path, given)}{_default(path)}"
        return said + _default(path)
    message = str(found["msg"])
    return f"{message[0].lower()}{message[1:]}{_default(path)}"


def _share_rule(path: Path, given: float) -> str:
    """Return the rule for a number above 1 in the place of a share of one."""
    percent = f"{given:g} % is written {given / 100:g}" if 2 <= given <= 100 else ""
    shape = next((i for i, p in enumerate(path) if p in _SHAPES), None)
    if shape is None:
        return percent or "it is a share of one"
    side = "width" if int(path[-1]) % 2 == 0 else "height"
    pixels = f"{given:g} pixels are {given:g} divided by the stimulus' {side} in pixels" if given >= 2 else ""
    comma = f"0,{given} is written 0.{given}" if isinstance(given, int) and 1 < given < 10 else ""
    meant = ", ".join(part for part in (comma, percent, pixels) if part)
    return f"it is a share of the stimulus' {side}" + (f": {meant}" if meant else "")


def _default(path: Path) -> str:
    if path[:1] == (CONDITIONS,):
        path = path[2:]
    default = default_at(path)
    return "" if default in (None, "") else f"; write for example the default, {json.dumps(default)}"
