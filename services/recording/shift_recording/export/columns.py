"""The columns of the tables: names, types, units and meanings, derived from the messages. Pure.

A message's fields become columns. Nested fields are joined with ``_``: ``capacity_value``, ``strategy_negation``,
``weights_robot``, ``probability_1``. The recordings say which strategies, AOIs and tasks there are (:class:`Names`).
"""

from __future__ import annotations

import types
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel
from shift_schemas.messages import Seen, Strategy
from shift_schemas.timestamps import Stamp

ColumnType = Literal["text", "number", "integer", "boolean", "time"]
"""``time`` is nanoseconds since the epoch; a CSV file has it as ISO 8601 in UTC."""

PLAIN: dict[object, ColumnType] = {str: "text", float: "number", int: "integer", bool: "boolean"}
SINGULAR = {"probabilities": "probability"}
REFUSALS = ("malformed", "conflict", "too-large", "unavailable")
"""The kinds of problems for which the monitor refuses a chunk of gaze."""
UNITS = {"_s": "s", "_utc": "UTC", "_cm": "cm"}


@dataclass(frozen=True)
class Column:
    """One column of a table."""

    name: str
    type: ColumnType
    meaning: str
    source: str
    """The topic of the recording that it is from."""

    @property
    def unit(self) -> str:
        """The unit, empty for a value without one."""
        return next((unit for end, unit in UNITS.items() if self.name.endswith(end)), "")


@dataclass
class Names:
    """The names that the recordings of one export have; each becomes a column."""

    aois: dict[str, None] = field(default_factory=dict)
    strategies: dict[str, None] = field(default_factory=dict)
    tasks: dict[str, None] = field(default_factory=dict)
    covariates: dict[str, None] = field(default_factory=dict)
    actions: int = 0
    """The largest number of actions in a decision."""


def short(prefix: str, name: str) -> str:
    """Return the column's name: what an observation says of gaze has no prefix, except the gaze class."""
    whole = prefix + name
    return whole if not prefix or whole == "gaze_category" else whole.removeprefix("gaze_")


def columns_of(kind: type[BaseModel], names: Names, source: str, prefix: str = "") -> Iterator[Column]:
    """Yield the columns of a message's fields, without ``session``, ``seen``, ``required`` and ``actions``."""
    for name, info in kind.model_fields.items():
        if not prefix and name in ("session", "seen", "required", "actions"):
            continue
        meaning = info.description or ""
        yield from _columns(_bare(info.annotation), names, source, short(prefix, name), meaning)


def _columns(annotation: Any, names: Names, source: str, name: str, meaning: str) -> Iterator[Column]:
    if annotation is Stamp:
        yield Column(f"{name}_utc", "time", meaning, source)
    elif isinstance(annotation, type) and issubclass(annotation, BaseModel) and annotation is not Seen:
        yield from (
            Column(c.name, c.type, _joined(meaning, c.meaning), source)
            for c in columns_of(annotation, names, source, f"{name}_")
        )
    elif get_origin(annotation) is dict:
        for key in _keys(name, names):
            of = _bare(get_args(annotation)[1])
            yield from _columns(of, names, source, f"{name}_{key}", _joined(meaning, key))
    elif get_origin(annotation) is list and _bare(get_args(annotation)[0]) is float:
        for n in range(1, names.actions + 1):
            yield Column(f"{SINGULAR.get(name, name)}_{n}", "number", f"{meaning} Action {n}.", source)
    else:
        yield Column(name, PLAIN.get(annotation, "text"), meaning, source)


def _keys(name: str, names: Names) -> Mapping[str, None]:
    last = name.rsplit("_", 1)[-1]
    if last == "weights":
        return names.aois
    if last == "awareness":
        return names.tasks
    if name == "refused":
        return dict.fromkeys(REFUSALS)
    return names.strategies if last in ("strategy", "scores", "suggested", "action") else {}


def _joined(first: str, second: str) -> str:
    return " ".join(part for part in (first, second) if part)


def _bare(annotation: Any) -> Any:
    """Return X for ``Annotated[X, ...]``, for ``X | None`` and for a type alias."""
    if annotation is Strategy:
        return dict[str, str]
    origin = get_origin(annotation)
    if origin is Union or origin is types.UnionType:
        return _bare(next(a for a in get_args(annotation) if a is not type(None)))
    if hasattr(annotation, "__metadata__"):
        return _bare(get_args(annotation)[0])
    if origin is Literal:
        return str
    return annotation


def values_of(message: BaseModel, prefix: str = "") -> dict[str, Any]:
    """Return a message's values by column; texts of a list are joined with ``" | "``."""
    found: dict[str, Any] = {}
    values = message.__dict__
    for name, column in _fields(type(message), prefix):
        value = values[name]
        if value is None or type(value) in PLAIN:
            found[column] = value
        else:
            _put(found, column, value)
    return found


@cache
def _fields(kind: type[BaseModel], prefix: str) -> tuple[tuple[str, str], ...]:
    """Return the fields of a message, each with the name of its column."""
    left_out = () if prefix else ("session", "seen", "required", "actions")
    return tuple((name, short(prefix, name)) for name in kind.model_fields if name not in left_out)


def _put(found: dict[str, Any], name: str, value: Any) -> None:
    if isinstance(value, Stamp):
        found[f"{name}_utc"] = value.ns
    elif isinstance(value, BaseModel) and not isinstance(value, Seen):
        found.update(values_of(value, f"{name}_"))
    elif isinstance(value, Mapping):
        for key, each in value.items():
            if each is None or type(each) in PLAIN:
                found[f"{name}_{key}"] = each
            else:
                _put(found, f"{name}_{key}", each)
    elif isinstance(value, list) and value and isinstance(value[0], float):
        found.update((f"{SINGULAR.get(name, name)}_{n}", each) for n, each in enumerate(value, 1))
    elif isinstance(value, list):
        found[name] = " | ".join(each.model_dump_json() if isinstance(each, BaseModel) else str(each) for each in value)
    else:
        found[name] = value
