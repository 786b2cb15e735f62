"""Simulated users: the probability of success for each of the 30 triples and 6 actions.

Pure. Users A to D are the paper's (section V-B; docs/model.md, section 5). Any other user comes from a user file in
JSON (docs/evaluation.md, "User files"). A user is data: ``batched_sessions`` simulates many runs of it at once, and
``simulated_person`` simulates one.
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
from shift_study.constants import CapacitySettings
from shift_study.fields import Level, NonNegative, Probability
from shift_study.scoring import suggestions
from shift_study.scoring_table import ScoringSettings
from shift_study.study import Study

ACTIONS = 6
DEVIATION = 0.05
"""Probability that a fair coin decides the outcome (the paper's "5 % of behavior that deviates")."""
DURATIONS = (4, 5, 6, 7, 8)
"""Values of T in seconds, equally probable; fitted (docs/model.md, section 5)."""

Table = Annotated[
    list[Annotated[list[Probability], Field(min_length=ACTIONS, max_length=ACTIONS)]],
    Field(min_length=len(TRIPLES), max_length=len(TRIPLES)),
]


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)


class Change(_Part):
    """A change of the person: from here on another table holds."""

    at: int = Field(ge=1, le=100_000, description="The number of interactions before the change.")
    success: Table = Field(description="The table after the change.")


class GazeHabit(_Part):
    """How the gaze class continues from one interaction to the next. The first one is focused."""

    keep: Probability = Field(default=0.3, description="Probability that it stays; else it is drawn uniformly. Fitted.")


class TrueCapacity(_Part):
    """The capacity constants of this person that differ from the study's."""

    start: NonNegative | None = None
    min: NonNegative | None = None
    max: NonNegative | None = None
    recovery: NonNegative | None = None
    demanding_cost: NonNegative | None = None
    other_cost: NonNegative | None = None
    threshold: NonNegative | None = None
    demanding: Annotated[list[Level], Field(max_length=32)] | None = None


class User(_Part):
    """A simulated user, with the fields of a user file."""

    user: Id = Field(description="The user's name.")
    success: Table = Field(description="Probability of success, 30 triples x 6 actions, before the coin flips.")
    changes: Annotated[list[Change], Field(max_length=1000)] = Field(default=[], description="In rising order of at.")
    gaze: GazeHabit = GazeHabit()
    tasks: int = Field(default=3, ge=1, le=500, description="How many tasks, drawn uniformly with replacement.")
    capacity: TrueCapacity = TrueCapacity()

    @model_validator(mode="after")
    def _changes_rise(self) -> User:
        if any(b.at <= a.at for a, b in zip(self.changes, self.changes[1:], strict=False)):
            raise ValueError("changes must be in rising order of at")
        return self

    def table_at(self, n: int) -> NDArray[np.float64]:
        """Return the table that holds for interaction ``n`` (from 1), float [30, 6]."""
        past = [change.success for change in self.changes if n > change.at]
        return np.asarray(past[-1] if past else self.success, dtype=np.float64)


def true_capacity(user: User, study: Study) -> CapacitySettings:
    """Return the person's own capacity constants: those of the user file, and the study's for the rest."""
    own = user.capacity.model_dump(exclude_none=True)
    try:
        return CapacitySettings.model_validate(study.capacity.model_dump() | own)
    except ValidationError as e:
        raise InvalidSettings(f"user {user.user}: capacity: {_describe(e)}", field_errors(e, "capacity")) from e


# --- users A to D ---


def paper_user(name: str) -> User:
    """Return user A, B, C or D of the paper (section V-B)."""
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
    """Return whether the action succeeds (docs/model.md, section 5). Actions 0 and 1 have no negation."""
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
    """Return the user that ``text`` (JSON) describes.

    Raises
    ------
    InvalidSettings
        The text has mistakes. The message names the file (``name``), and the place, value and rule of each mistake.
    """
    try:
        data = json.loads(text, parse_constant=_refuse_constant, object_pairs_hook=_refuse_repeats)
    except (ValueError, RecursionError) as e:
        raise InvalidSettings(f"{name}: this is not a user file in JSON: {e}") from e
    try:
        return User.model_validate_json(json.dumps(data))
    except ValidationError as e:
        raise InvalidSettings(f"{name}: {_describe(e)}", field_errors(e)) from e


def _describe(error: ValidationError) -> str:
    return "; ".join(f"{f.field} is {f.value or 'missing'}: {f.rule}" for f in field_errors(error))


def _refuse_constant(text: str) -> Any:
    raise ValueError(f"{text} is not a number in JSON; write a number")


def _refuse_repeats(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    keys = [key for key, _ in pairs]
    if repeats := [key for key in keys if keys.count(key) > 1]:
        raise ValueError(f"{shorten(repeats[0])!r} is given twice; keep one of the two")
    return dict(pairs)
