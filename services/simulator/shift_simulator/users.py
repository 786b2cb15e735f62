"""Simulated users: for each of the 30 triples and 6 actions, how probable success is.

Pure. Users A to D are the paper's (section V-B; MODEL.md, section 5); any other comes from a user file,
which is JSON (INTERFACE.md, "Command line"). A user is data: ``batched_sessions`` simulates many runs of it
at once, ``simulated_person`` one.
"""

from __future__ import annotations

import json
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator
from shift_model.vocabulary import TRIPLES, Triple
from shift_schemas.errors import InvalidSettings, field_errors, shorten
from shift_schemas.ids import Id
from shift_study.scoring import suggestions
from shift_study.study import CapacitySettings, Level, NonNegative, Probability, ScoringSettings, Study

ACTIONS = 6
DEVIATION = 0.05
"""Probability that an outcome is a fair coin: the paper's "5 % of behavior that deviates"."""
DURATIONS = (4, 5, 6, 7, 8)
"""T in seconds, each as probable; fitted (MODEL.md, section 5)."""

Table = Annotated[
    list[Annotated[list[Probability], Field(min_length=ACTIONS, max_length=ACTIONS)]],
    Field(min_length=len(TRIPLES), max_length=len(TRIPLES)),
]


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)


class Change(_Part):
    """The person changes: another table holds from here on."""

    at: int = Field(ge=1, le=100_000, description="After this many interactions.")
    success: Table = Field(description="The table from then on.")


class GazeHabit(_Part):
    """How the gaze class goes on from one interaction to the next; it begins focused."""

    keep: Probability = Field(default=0.3, description="Kept with this probability, else uniform; fitted.")


class TrueCapacity(_Part):
    """What differs from the study's capacity constants in this person."""

    start: NonNegative | None = None
    min: NonNegative | None = None
    max: NonNegative | None = None
    recovery: NonNegative | None = None
    demanding_cost: NonNegative | None = None
    other_cost: NonNegative | None = None
    threshold: NonNegative | None = None
    demanding: Annotated[list[Level], Field(max_length=32)] | None = None


class User(_Part):
    """A simulated user, as a user file gives it."""

    user: Id = Field(description="Its name.")
    success: Table = Field(description="Probability of success, 30 triples x 6 actions, before the coin flips.")
    changes: Annotated[list[Change], Field(max_length=1000)] = Field(default=[], description="In rising order.")
    gaze: GazeHabit = GazeHabit()
    tasks: int = Field(default=3, ge=1, le=500, description="How many tasks, drawn uniformly with replacement.")
    capacity: TrueCapacity = TrueCapacity()

    @model_validator(mode="after")
    def _changes_rise(self) -> User:
        if any(b.at <= a.at for a, b in zip(self.changes, self.changes[1:], strict=False)):
            raise ValueError("changes must be in rising order of at")
        return self

    def table_at(self, n: int) -> NDArray[np.float64]:
        """The table that holds for interaction ``n`` (from 1): float [30, 6]."""
        held = [change.success for change in self.changes if n > change.at]
        return np.asarray(held[-1] if held else self.success, dtype=np.float64)


def true_capacity(user: User, study: Study) -> CapacitySettings:
    """The person's own capacity constants: the study's, but for what the user file says."""
    differs = user.capacity.model_dump(exclude_none=True)
    try:
        return CapacitySettings.model_validate(study.capacity.model_dump() | differs)
    except ValidationError as e:
        raise InvalidSettings(f"user {user.user}: capacity: {_said(e)}", field_errors(e, "capacity")) from e


# --- the paper's four ---


def paper_user(name: str) -> User:
    """User A, B, C or D of the paper (section V-B), each a function of the one before."""
    if name not in PAPER_USERS:
        raise InvalidSettings(f"there is no built-in user {shorten(name)!r}; write one of {', '.join(PAPER_USERS)}")
    suggested = suggestions(ScoringSettings.model_validate({}))
    table = [
        [float(_succeeds(name, triple, action, action == suggested[i])) for action in range(ACTIONS)]
        for i, triple in enumerate(TRIPLES)
    ]
    return User(user=name, success=table)


PAPER_USERS = ("A", "B", "C", "D")


def _succeeds(name: str, triple: Triple, action: int, suggested: bool) -> bool:
    """MODEL.md, section 5. A negation is any action but the two affirmations, which come first."""
    if name == "A" or action < 2:
        return suggested
    fails = triple.capacity == "high"
    if name in "CD":
        fails |= triple.awareness in ("misconception_enabledness", "success")
    if name == "D":
        fails |= triple.gaze != "focused"
    return not fails


# --- user files ---


def parse_user(text: str, name: str = "user file") -> User:
    """The user that ``text`` spells (JSON).

    Raises
    ------
    InvalidSettings
        Naming the place, the value and the rule of each mistake; ``name`` is the file's.
    """
    try:
        data = json.loads(text, parse_constant=_no_constant, object_pairs_hook=_no_repeats)
    except (ValueError, RecursionError) as e:
        raise InvalidSettings(f"{name}: this is not a user file in JSON: {e}") from e
    try:
        return User.model_validate_json(json.dumps(data))
    except ValidationError as e:
        raise InvalidSettings(f"{name}: {_said(e)}", field_errors(e)) from e


def _said(error: ValidationError) -> str:
    return "; ".join(f"{f.field} is {f.value or 'missing'}: {f.rule}" for f in field_errors(error))


def _no_constant(text: str) -> Any:
    raise ValueError(f"{text} is not a number in JSON; write a number")


def _no_repeats(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    keys = [key for key, _ in pairs]
    if twice := [key for key in keys if keys.count(key) > 1]:
        raise ValueError(f"{shorten(twice[0])!r} is given twice; keep one of the two")
    return dict(pairs)
