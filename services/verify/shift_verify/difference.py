"""Find how a recorded fact and the derived fact differ: the first field, and both values. Pure."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple, NoReturn

from shift_schemas.errors import shorten
from shift_schemas.messages import Config, Fact
from shift_schemas.registry import OWNER_OF
from shift_study.loading import study_data, study_from_json

PRECISION = 1e-12
"""Relative. Chosen: ``exp`` and ``atan`` of two machines may differ in the last digit of a number, and no more.
"""

LAST = 2**61
"""A place after all messages: a difference there comes first only if no message differs."""


class FactAtPlace(NamedTuple):
    """A recorded fact, with its owner's sequence and its place in the file."""

    place: int
    sequence: int
    fact: Fact


@dataclass(frozen=True)
class Difference:
    """A place where a recording differs from what its inputs give.

    ``subject`` is that of the message, or ``checksum``, ``file``, ``metadata`` or ``attachment``. ``field`` is the
    path within it, empty for the whole message. ``sequence`` is 0 if it is not known.
    """

    subject: str
    sequence: int
    field: str
    recorded: Any
    derived: Any
    sentence: str

    def as_json(self) -> dict[str, Any]:
        """Return the difference as ``--json`` prints it."""
        return asdict(self)


class Differs(Exception):
    """A difference and its place in the file. A missing message ranks before the differences that follow from it."""

    def __init__(self, place: int, difference: Difference, missing: bool = False) -> None:
        super().__init__(difference.sentence)
        self.place = place
        self.difference = difference
        self.missing = missing

    @property
    def rank(self) -> tuple[bool, int]:
        """The sort key; the smallest is the first difference. Others follow from a configuration, so that is first."""
        return (not self.missing and self.difference.subject != "config", self.place)


class NotRecorded(Exception):
    """An unfinished recording lacks an input that an output has seen, so nothing more can be derived."""


def differ(at: FactAtPlace, field: str, recorded: Any, derived: Any, why: str = "") -> NoReturn:
    """Raise that ``field`` of a recorded fact differs from the derived value."""
    subject = at.fact.subject
    said = why or f"{field or 'it'} is {_said(recorded)} in the recording and {_said(derived)} derived again"
    sentence = f"{name_of(subject, at.sequence)}: {said}"
    raise Differs(at.place, Difference(subject, at.sequence, field, recorded, derived, sentence))


def is_missing(subject: str, sequence: int, place: int, why: str, derived: Fact | None = None) -> NoReturn:
    """Raise that a fact is not in the recording."""
    whole = derived.model_dump(mode="json") if derived is not None else None
    name = name_of(subject, sequence) if sequence else f"a {subject}"
    difference = Difference(subject, sequence, "", None, whole, f"{name} is missing: {why}")
    raise Differs(place, difference, missing=True)


def name_of(subject: str, sequence: int) -> str:
    """Return the name of a message in a sentence: ``decision (decider's message 57)``."""
    return f"{subject} ({OWNER_OF[subject]}'s message {sequence})"


def compare(recorded: FactAtPlace, derived: Fact) -> None:
    """Raise :class:`Differs` with the first field in which both differ."""
    fact = recorded.fact
    if fact == derived:
        return
    if fact.subject != derived.subject:
        differ(recorded, "", fact.subject, derived.subject, f"a {derived.subject} should stand here")
    found = first_field(_plain(fact), _plain(derived), "")
    if found is not None:
        differ(recorded, *found)


def _plain(fact: Fact) -> dict[str, Any]:
    """Return the fields of the fact; the study of a configuration, which is one string, as the study that it spells.

    A study of an earlier version has fewer fields, and the missing ones get their defaults. Warnings are left out:
    they are advice, and a later version may word them differently.
    """
    data: dict[str, Any] = fact.model_dump(mode="json", exclude={"warnings"})
    return data | {"study": study_data(study_from_json(fact.study))} if isinstance(fact, Config) else data


def first_field(one: Any, other: Any, at: str) -> tuple[str, Any, Any] | None:
    """Return path and values of the first difference of two plain values; numbers may differ by ``PRECISION``."""
    if isinstance(one, dict) and isinstance(other, dict):
        return _first_of({**one, **other}, one, other, at)
    if isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        return _first_of(range(len(one)), dict(enumerate(one)), dict(enumerate(other)), at)
    return None if _same(one, other) else (at, one, other)


def _first_of(keys: Any, one: dict[Any, Any], other: dict[Any, Any], at: str) -> tuple[str, Any, Any] | None:
    for key in keys:
        found = first_field(one.get(key), other.get(key), f"{at}.{key}" if at else str(key))
        if found is not None:
            return found
    return None


def _same(one: Any, other: Any) -> bool:
    if isinstance(one, float) and isinstance(other, float | int):
        return math.isclose(one, other, rel_tol=PRECISION, abs_tol=PRECISION)
    return type(one) is type(other) and bool(one == other)


def _said(value: Any) -> str:
    return "left out" if value is None else shorten(repr(value))
