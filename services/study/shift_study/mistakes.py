"""Mistakes in a study: line, field, value and rule, and the error that lists them. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

from shift_schemas.errors import FieldError, InvalidStudy, shorten

from shift_study.rules import rule_of
from shift_study.shape import Path, annotation_at, dotted, keys_at

Lines = dict[Path, int]
RULE_LENGTH = 400
"""Characters of a rule that are kept: a rule names the known values, and those can be long."""
MISTAKES = 20
"""How many mistakes an error lists."""


class Mistake(NamedTuple):
    """One mistake; ``line`` is None without a file, and ``field`` is empty for a mistake of the whole study."""

    line: int | None
    field: str
    value: str
    rule: str

    def sentence(self, name: str) -> str:
        """Return the sentence; ``name`` is the file's."""
        where = f"{name}:{self.line}" if self.line else name
        return ": ".join(part for part in (where, self.field, self.rule) if part)

    @property
    def error(self) -> FieldError:
        """The mistake as errors carry it, without its line."""
        return FieldError(field=self.field or "study", value=self.value, rule=self.rule)


def mistake_at(line: int | None, path: Path, value: object, rule: str) -> Mistake:
    """Return a mistake with its value and rule shortened."""
    rule = rule if len(rule) <= RULE_LENGTH else rule[: RULE_LENGTH - 1] + "…"
    return Mistake(line, shorten(dotted(path)), shorten(value), rule)


def refusal(name: str, mistakes: Iterable[Mistake]) -> InvalidStudy:
    """Return the error that lists the mistakes in the order of their lines; ``name`` is the file's."""
    listed = sorted(dict.fromkeys(mistakes), key=lambda m: m.line or 0)[:MISTAKES]
    sentences = tuple(m.sentence(name) for m in listed)
    return InvalidStudy("; ".join(sentences), tuple(m.error for m in listed), sentences)


def mistakes_of(found: Any, lines: Lines, under: Path) -> Iterator[Mistake]:
    """Yield the mistakes in one error of pydantic; ``under`` is the path of a condition, or empty."""
    path: Path = tuple(p for p in found["loc"] if p != "[key]")
    if found["type"] == "table_cells":
        for cell, value, rule in found["ctx"]["cells"]:
            yield _placed((*path, *cell), value, rule, lines, under)
        return
    path = path or _named_first(found["msg"])
    value = "" if found["type"] == "missing" else shorten(found["input"])
    yield _placed(path, value, rule_of(found, path, value), lines, under)


def _placed(path: Path, value: str, rule: str, lines: Lines, under: Path) -> Mistake:
    ways = ((*start, *path[:n]) for start in (under, ()) for n in range(len(path), -1, -1))
    line = next((lines[way] for way in ways if way and way in lines), lines.get(()))
    return mistake_at(line, (*under, *path), value, rule)


def _named_first(message: str) -> Path:
    """Return the path of the part that a mistake of the whole study names first: the part to change."""
    path = tuple(message.removeprefix("Value error, ").split(" ", 1)[0].split("."))
    return path if path[0] in keys_at(()) and annotation_at(path) is not None else ()
