"""How a recorded fact and the fact derived again differ: the first field, and both values. Pure."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple, NoReturn

from shift_schemas.errors import shorten
from shift_schemas.messages import Config, Fact
from shift_schemas.registry import OWNER_OF
from shift_study.loading import study_data, study_from_json

PRECISION = 1e-12
"""Relative; chosen: ``exp`` and ``atan`` of two machines may differ in a number's last digit, a result may not."""


class Placed(NamedTuple):
    """A recorded fact, with its owner's sequence and its place in the file."""

    place: int
    sequence: int
    fact: Fact


@dataclass(frozen=True)
class Difference:
    """Where a recording is not what its inputs give.

    ``subject`` is the message's, or ``checksum``, ``file``, ``metadata`` or ``attachment``; ``field`` is the path
    within it, empty where the whole is meant. A ``sequence`` of 0 is an unknown one.
    """

    subject: str
    sequence: int
    field: str
    recorded: Any
    derived: Any
    sentence: str

    def as_json(self) -> dict[str, Any]:
        """For ``--json``."""
        return asdict(self)


class Differs(Exception):
    """A difference, and where in the file. What is ``missing`` goes before all that follows from its absence."""

    def __init__(self, place: int, difference: Difference, missing: bool = False) -> None:
        super().__init__(difference.sentence)
        self.place = place
        self.difference = difference
        self.missing = missing

    @property
    def rank(self) -> tuple[bool, int]:
        """The smallest is the first difference. All else follows from a configuration: a wrong one comes first."""
        return (not self.missing and self.difference.subject != "config", self.place)


class NotRecorded(Exception):
    """An unfinished recording lacks an input that an output has seen: from there on nothing can be derived."""


def differ(at: Placed, field: str, recorded: Any, derived: Any, why: str = "") -> NoReturn:
    """Raise that ``field`` of a recorded fact is not what it must be."""
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
    """How a message is called in a sentence: ``decision (decider's message 57)``."""
    return f"{subject} ({OWNER_OF[subject]}'s message {sequence})"


def compare(recorded: Placed, derived: Fact) -> None:
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
    """The fact's fields; a configuration's study, one string, as the study that it spells.

    Without its warnings: they are advice, and a later version may say them in other words.
    So a recording of an earlier version, whose studies have fewer fields, is as good as one of today.
    """
    data: dict[str, Any] = fact.model_dump(mode="json", exclude={"warnings"})
    return data | {"study": study_data(study_from_json(fact.study))} if isinstance(fact, Config) else data


def first_field(one: Any, other: Any, at: str) -> tuple[str, Any, Any] | None:
    """Path and values of the first difference of two plain values; numbers may differ by ``PRECISION``."""
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
