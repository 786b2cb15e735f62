"""The scaffolding strategies and the scoring table (paper, section III-C, Table I)."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from itertools import product
from typing import Annotated, Any

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError
from shift_model.vocabulary import Triple, cognitive_state_name
from shift_schemas.suggestions import did_you_mean

from shift_study.fields import Level, NonNegative, Positive, StudyPart
from shift_study.patching import merge_patch


class StrategySettings(StudyPart):
    """One scaffolding strategy: its column of the scoring table is ranked into its levels."""

    weight: NonNegative = Field(default=1.0, description="S_weight; 1 leaves the score as it is.")
    levels: list[Level] = Field(min_length=2, max_length=8, description="From least to most, ids in lower case.")
    thresholds: list[NonNegative] = Field(description="Score from which each further level holds; rising.")

    @model_validator(mode="after")
    def _ranked(self) -> StrategySettings:
        if len(self.thresholds) != len(self.levels) - 1:
            raise ValueError(
                f"{len(self.levels)} levels need {len(self.levels) - 1} thresholds; they are {self.thresholds}"
            )
        if any(a >= b for a, b in zip(self.thresholds, self.thresholds[1:], strict=False)):
            raise ValueError(f"thresholds must rise; they are {self.thresholds}")
        if len(set(self.levels)) != len(self.levels):
            raise ValueError(f"levels must differ; they are {', '.join(self.levels)}")
        return self


DEFAULT_STRATEGIES: dict[str, Any] = {
    "negation": {
        "weight": 1.0,
        "levels": ["affirmation", "negation_affirmation", "negation"],
        "thresholds": [0.5, 0.8333333333333334],
    },
    "hesitation": {"weight": 1.0, "levels": ["none", "hesitation"], "thresholds": [0.5]},
}
"""Thresholds: midpoints between attainable scores, the one option of 75 that fits the paper's text."""


DEFAULT_TABLE: dict[str, dict[str, dict[str, float]]] = {
    "capacity": {"low": {"negation": 0, "hesitation": 1}, "high": {"negation": 1, "hesitation": 0}},
    "gaze": {
        "distracted": {"negation": 1, "hesitation": 1},
        "uncertain": {"negation": 1, "hesitation": 1},
        "focused": {"negation": 0, "hesitation": 0},
    },
    "awareness": {
        "unknown": {"negation": 0, "hesitation": 1},
        "failure": {"negation": 0, "hesitation": 1},
        "misconception_enabledness": {"negation": 1, "hesitation": 0},
        "misconception_comprehension": {"negation": 0, "hesitation": 1},
        "success": {"negation": 1, "hesitation": 0},
    },
}
"""The paper's Table I."""


Entry = Annotated[float, Field(ge=0, le=1)]


Row = dict[str, Entry]


class CapacityRows(StudyPart):
    """Rows of the scoring table for processing capacity."""

    low: Row
    high: Row


class GazeRows(StudyPart):
    """Rows of the scoring table for the gaze distribution."""

    distracted: Row
    uncertain: Row
    focused: Row


class AwarenessRows(StudyPart):
    """Rows of the scoring table for task awareness."""

    unknown: Row
    failure: Row
    misconception_enabledness: Row
    misconception_comprehension: Row
    success: Row


class ScoringTable(StudyPart):
    """Table I of the paper: for each category, its score for each strategy."""

    capacity: CapacityRows
    gaze: GazeRows
    awareness: AwarenessRows

    def rows(self, triple: Triple) -> tuple[Row, Row, Row]:
        """Return the three rows of a triple."""
        return (
            getattr(self.capacity, triple.capacity),
            getattr(self.gaze, triple.gaze),
            getattr(self.awareness, triple.awareness),
        )


class ScoringSettings(StudyPart):
    """The scoring system (paper, section III-C). Parts that are left out have their defaults.

    A strategy that is set to null is removed. A further strategy needs a further column in the table. The actions have
    the order of the listed strategies if all default strategies are named, and the default order otherwise.
    """

    strategies: dict[Level, StrategySettings] = Field(
        min_length=1, max_length=6, description="The scaffolding strategies, in the order of the actions' levels."
    )
    table: ScoringTable = Field(description="The paper's Table I; chosen otherwise for what a study adds.")
    s_max: Positive = Field(default=3.0, description="S_max: the sum that is a score of 1; three observations.")

    @model_validator(mode="before")
    @classmethod
    def _over_the_default(cls, given: Any) -> Any:
        if not isinstance(given, dict):
            return given
        strategies = given.get("strategies", {})
        table = given.get("table", {})
        if not isinstance(strategies, dict) or not isinstance(table, dict):
            return given
        merged = merge_patch(DEFAULT_STRATEGIES, strategies)
        if DEFAULT_STRATEGIES.keys() <= strategies.keys():  # all named: the study's order is the actions' order
            merged = {name: merged[name] for name in strategies if name in merged}
        return given | {
            "strategies": merged,
            "table": merge_patch(_columns(DEFAULT_TABLE, merged), table),
        }

    @model_validator(mode="after")
    def _complete(self) -> ScoringSettings:
        if cells := self._wrong_cells():
            raise PydanticCustomError("table_cells", "the table does not fit the strategies", {"cells": cells})
        actions = 1
        for strategy in self.strategies.values():
            actions *= len(strategy.levels)
        if actions > 64:
            raise ValueError(f"the levels make {actions} actions; at most 64 can be learned about")
        return self

    def _wrong_cells(self) -> list[tuple[tuple[str, ...], str, str]]:
        """Yield path, value and rule of each cell that is missing or belongs to no strategy of the study."""
        cells: list[tuple[tuple[str, ...], str, str]] = []
        names = ", ".join(self.strategies)
        for part in ScoringTable.model_fields:
            for category, row in getattr(self.table, part):
                path = ("table", part, category)
                missing = [name for name in self.strategies if name not in row]
                cells += [((*path, name), "", f"it is missing; write 0 or 1 for {name}") for name in missing]
                for name in (name for name in row if name not in self.strategies):
                    rule = f"{name!r} is not a strategy; write one of {names}{did_you_mean(name, missing)}"
                    cells.append(((*path, name), name, rule))
        return cells

    @cached_property
    def actions(self) -> tuple[tuple[str, ...], ...]:
        """Every combination of levels in the order of the strategies; the last strategy varies first."""
        return tuple(product(*(s.levels for s in self.strategies.values())))

    @cached_property
    def choices(self) -> tuple[dict[str, str], ...]:
        """Every action as messages carry it."""
        return tuple(self.strategy(action) for action in self.actions)

    @cached_property
    def states(self) -> tuple[str, ...]:
        """The cognitive states, one per action and in the order of the actions: each *is* its action."""
        return tuple(cognitive_state_name(action) for action in self.actions)

    def strategy(self, action: tuple[str, ...]) -> dict[str, str]:
        """Return an action as messages carry it: ``{"negation": "affirmation", "hesitation": "none"}``."""
        return dict(zip(self.strategies, action, strict=True))


def strategy_name(strategy: Mapping[str, str]) -> str:
    """Return the levels of an action as one name: ``negation + hesitation``."""
    return " + ".join(strategy.values())


def _columns(table: dict[str, dict[str, dict[str, float]]], strategies: Any) -> dict[str, Any]:
    """Return the default table with the columns of the remaining strategies."""
    return {
        part: {category: {s: v for s, v in row.items() if s in strategies} for category, row in rows.items()}
        for part, rows in table.items()
    }
