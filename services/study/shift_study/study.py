"""The study file: what a researcher configures, with every constant of the model beside its reason.

A value marked *paper* is the paper's (arXiv 2503.16447); every other is a chosen default. What may be
left out, the ranges and what can change while a session runs are INTERFACE.md's, "Study file".
"""

from __future__ import annotations

from functools import cached_property
from itertools import product
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator
from pydantic_core import PydanticCustomError
from shift_model.vocabulary import (
    LearnerName,
    Triple,
    cognitive_state_name,
)
from shift_schemas.ids import Id
from shift_schemas.suggestions import did_you_mean

NonNegative = Annotated[float, Field(ge=0, le=1e6)]
Positive = Annotated[float, Field(gt=0, le=1e6)]
Probability = Annotated[float, Field(ge=0, le=1)]
Level = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]{0,31}$")]
Point = Annotated[list[Probability], Field(min_length=2, max_length=2)]


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)


class Aoi(_Part):
    """An area of interest on the stimulus, 0..1 from the upper left corner: a rectangle or a polygon."""

    name: Id = Field(description="Its name, as gaze on AOIs and the weights carry it.")
    rectangle: Annotated[list[Probability], Field(min_length=4, max_length=4)] | None = Field(
        default=None, description="left, top, right, bottom; 0..1."
    )
    polygon: Annotated[list[Point], Field(min_length=3, max_length=256)] | None = Field(
        default=None, description="The corners, [x, y] each, 0..1."
    )

    @model_validator(mode="after")
    def _one_shape(self) -> Aoi:
        if (self.rectangle is None) == (self.polygon is None):
            raise ValueError("give either rectangle: [left, top, right, bottom] or polygon: [[x, y], ...]")
        if self.rectangle and not (self.rectangle[0] < self.rectangle[2] and self.rectangle[1] < self.rectangle[3]):
            raise ValueError(_not_left_top_right_bottom(self.name, self.rectangle))
        return self


class CapacitySettings(_Part):
    """Processing capacity: a battery that explanations draw on (paper, section III-A1)."""

    start: NonNegative = Field(default=1.0, description="At the start of a session; a fresh partner, chosen.")
    min: NonNegative = Field(default=0.0, description="Floor (C_min), chosen.")
    max: NonNegative = Field(default=1.0, description="Cap (C_max), chosen.")
    recovery: NonNegative = Field(default=0.30, description="Gained by a repeated strategy (Δ_rep), fitted.")
    demanding_cost: NonNegative = Field(default=0.20, description="Cost of a demanding strategy (Δ_cog), fitted.")
    other_cost: NonNegative = Field(default=0.10, description="Cost of any other strategy (Δ_ncog), fitted.")
    threshold: NonNegative = Field(default=0.5, description="High at or above it; the middle, chosen.")
    demanding: list[Level] = Field(
        default=["negation_affirmation", "negation"],
        description="Levels that make a strategy demanding: any negation.",
        max_length=32,
    )

    @model_validator(mode="after")
    def _ordered(self) -> CapacitySettings:
        if not self.min <= self.start <= self.max:
            raise ValueError(f"min <= start <= max must hold; it is {self.min} <= {self.start} <= {self.max}")
        return self


class AttentionSettings(_Part):
    """Attention weights and focus shift (paper, section III-A2), applied in proportion to dwell."""

    step_s: Positive = Field(default=0.1, description="Dwell that is one application of the equation, s; chosen.")
    maximum_dwell_s: Positive = Field(default=1.0, description="A named sample stands for at most this, s; chosen.")
    minimum_dwell_s: NonNegative = Field(
        default=0.5, description="The gaze class is uncertain until so much dwell on AOIs, s; chosen."
    )
    weight_step: Probability = Field(default=0.10, description="Gain of the fixated AOI per application (Δ_w); chosen.")
    weight_min: Probability = Field(default=0.0, description="Floor of a weight (w_min); chosen.")
    shift_increase: NonNegative = Field(default=0.20, description="Rise per change of target (Δ_inc); chosen.")
    shift_decrease: NonNegative = Field(default=0.05, description="Fall per application while held (Δ_dec); chosen.")
    focused_dominance: Probability = Field(default=0.5, description="Focused: largest weight at least this; chosen.")
    focused_shift: NonNegative = Field(default=0.33, description="Focused: focus shift at most this; chosen.")
    distracted_dominance: Probability = Field(default=0.35, description="Distracted: largest weight below; chosen.")
    distracted_shift: NonNegative = Field(default=0.66, description="Distracted: focus shift at least this; chosen.")


class FixationSettings(_Part):
    """Online fixation detection: median filter, then I-DT (Salvucci & Goldberg 2000)."""

    method: Literal["i-dt"] = Field(default="i-dt", description="Identification by dispersion threshold.")
    dispersion_deg: Positive = Field(default=2.0, description="x range + y range of a fixation, degrees; chosen.")
    minimum_duration_s: Positive = Field(default=0.06, description="A shorter one is none, s; chosen.")
    median_filter_s: NonNegative = Field(
        default=0.03,
        description="Window of the median filter, s; without it a noisy trial is lost (measured).",
    )
    maximum_gap_s: Positive = Field(default=0.075, description="A longer loss ends a fixation, s; a blink's length.")
    screen_width_cm: Positive = Field(default=50.9, description="Stimulus width, cm: a 23 inch screen.")
    screen_height_cm: Positive = Field(default=28.6, description="Stimulus height, cm.")
    distance_cm: Positive = Field(default=65.0, description="Eye to screen, cm: the tracker's recommendation.")


class AwarenessSettings(_Part):
    """Task awareness: success ratios over the last results (paper, section III-A3)."""

    window: int = Field(default=1, ge=1, le=10_000, description="How many of the last results count; chosen.")
    threshold: Probability = Field(default=0.5, description="A ratio at or above it is fine; chosen.")


class RewardSettings(_Part):
    """The reward function (paper, section III-E)."""

    decay: NonNegative = Field(default=0.1, description="k of exp(-k T), per second; paper.")
    scale: NonNegative = Field(default=1.0, description="λ, the factor of the mean of both dimensions; paper.")


class StrategySettings(_Part):
    """One scaffolding strategy: a column of the scoring table and the levels it is ranked into."""

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


class CapacityRows(_Part):
    """Rows of the scoring table for processing capacity."""

    low: Row
    high: Row


class GazeRows(_Part):
    """Rows of the scoring table for the gaze distribution."""

    distracted: Row
    uncertain: Row
    focused: Row


class AwarenessRows(_Part):
    """Rows of the scoring table for task awareness."""

    unknown: Row
    failure: Row
    misconception_enabledness: Row
    misconception_comprehension: Row
    success: Row


class ScoringTable(_Part):
    """Table I of the paper: for each category, how much it speaks for each strategy."""

    capacity: CapacityRows
    gaze: GazeRows
    awareness: AwarenessRows

    def rows(self, triple: Triple) -> tuple[Row, Row, Row]:
        """The three rows of a triple."""
        return (
            getattr(self.capacity, triple.capacity),
            getattr(self.gaze, triple.gaze),
            getattr(self.awareness, triple.awareness),
        )


class ScoringSettings(_Part):
    """The scoring system (paper, section III-C). Parts that are left out stay as the default has them.

    A strategy set to null is taken out; one more is a strategy more, and a column more in the table.
    The actions follow the strategies as listed where the default ones are all named, else as here.
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
        """Path, what stands there, and rule of each cell that is missing or belongs to no strategy of the study."""
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
        """Every action, as levels in the strategies' order, the last strategy fastest."""
        return tuple(product(*(s.levels for s in self.strategies.values())))

    @cached_property
    def choices(self) -> tuple[dict[str, str], ...]:
        """Every action as it is said on the wire."""
        return tuple(self.strategy(action) for action in self.actions)

    @cached_property
    def states(self) -> tuple[str, ...]:
        """The cognitive states, one per action and in the actions' order: each *is* its action."""
        return tuple(cognitive_state_name(action) for action in self.actions)

    def strategy(self, action: tuple[str, ...]) -> dict[str, str]:
        """An action as it is said on the wire: ``{"negation": "affirmation", "hesitation": "none"}``."""
        return dict(zip(self.strategies, action, strict=True))


class DeciderSettings(_Part):
    """How a decision comes about."""

    wait_s: Annotated[float, Field(ge=0, le=300)] = Field(
        default=2.0, description="How long a decision waits for what it must have seen, s; 0 never waits."
    )


class LearnerSettings(_Part):
    """Which learner, and its parameters. A learner takes no notice of parameters that are not its own."""

    name: LearnerName = Field(default="q-learning", description="The learner; fixed for a session.")
    learning_rate: Probability = Field(default=0.25, description="α of q-learning; paper.")
    discount: Probability = Field(default=0.0, description="γ of q-learning; paper.")
    epsilon: Probability = Field(default=0.75, description="ε at the start, falling to 0; paper.")
    scoring_prior: bool = Field(default=True, description="Whether the scoring system's suggestion is the prior.")
    prior_value: Annotated[float, Field(ge=0, le=100)] = Field(
        default=1.0, description="Q0 of the suggested action; fitted."
    )
    exploration: Annotated[float, Field(ge=0, le=100)] = Field(
        default=1.0, description="Width of ucb1's bonus, in units of its sqrt(2 ln n / visits); Auer et al. 2002."
    )
    thompson_states: Literal["cognitive", "triples"] = Field(
        default="cognitive", description="What thompson keeps a posterior for: six states or 30 triples; chosen."
    )
    prior_strength: Annotated[float, Field(ge=0, le=100)] = Field(
        default=4.0, description="Imagined results behind the scoring prior: thompson, linear-thompson; chosen."
    )
    noise: Annotated[float, Field(gt=0, le=100)] = Field(
        default=0.5, description="Standard deviation of a reward around linear-thompson's line; chosen."
    )
    planning_horizon: int = Field(
        default=4, ge=0, le=50, description="How many interactions planner looks ahead; chosen, 4 to 30 do the same."
    )
    planning_discount: Probability = Field(
        default=0.9, description="What planner's next interaction is worth of the present one; chosen."
    )
    flip_probability: Annotated[float, Field(gt=0, lt=1)] = Field(
        default=0.08, description="planner: how probable it is that an entry of the scoring table is wrong; chosen."
    )
    change_probability: Annotated[float, Field(ge=0, lt=1)] = Field(
        default=0.005, description="planner: how probable it is that the person changes at an interaction; chosen."
    )


class Study(_Part):
    """A study, whole."""

    study: Id = Field(description="The study's id.")
    title: Annotated[str, Field(max_length=500)] = Field(default="", description="For people.")
    tasks: Annotated[list[Id], Field(min_length=1, max_length=500)] | None = Field(
        default=None, description="The tasks; left out: any id is a task."
    )
    aois: Annotated[list[Aoi], Field(min_length=1, max_length=64)] = Field(
        default=[
            Aoi(name="left", rectangle=[0.0, 0.0, 1 / 3, 1.0]),
            Aoi(name="middle", rectangle=[1 / 3, 0.0, 2 / 3, 1.0]),
            Aoi(name="right", rectangle=[2 / 3, 0.0, 1.0, 1.0]),
        ],
        description="Areas of interest; where two overlap, the first counts. Left out: the thirds of the stimulus.",
    )
    require_condition: bool = Field(
        default=False, description="Whether a start without a condition is refused; chosen: a warning only."
    )
    conditions: Annotated[dict[Id, dict[str, Any]], Field(max_length=32)] = Field(
        default={}, description="Each overrides parts of what stands below it."
    )
    interactions: int = Field(default=100, ge=1, le=100_000, description="Planned number; ε reaches 0 there; paper.")
    capacity: CapacitySettings = CapacitySettings()
    attention: AttentionSettings = AttentionSettings()
    fixation: FixationSettings = FixationSettings()
    awareness: AwarenessSettings = AwarenessSettings()
    reward: RewardSettings = RewardSettings()
    scoring: ScoringSettings = Field(default_factory=lambda: ScoringSettings.model_validate({}))
    decider: DeciderSettings = DeciderSettings()
    learner: LearnerSettings = LearnerSettings()

    @field_validator("tasks")
    @classmethod
    def _tasks_differ(cls, tasks: list[str] | None) -> list[str] | None:
        if tasks is not None and len(set(tasks)) != len(tasks):
            raise ValueError(f"tasks must differ; {_twice(tasks)} is there twice")
        return tasks

    @field_validator("aois")
    @classmethod
    def _aois_differ(cls, aois: list[Aoi]) -> list[Aoi]:
        if len({a.name for a in aois}) != len(aois):
            raise ValueError(f"AOI names must differ; {_twice([a.name for a in aois])} is there twice")
        return aois

    @model_validator(mode="after")
    def _fits(self) -> Study:
        levels = {level for s in self.scoring.strategies.values() for level in s.levels}
        if unknown := [level for level in self.capacity.demanding if level not in levels]:
            raise ValueError(
                f"capacity.demanding names {', '.join(unknown)}; the strategies' levels are {', '.join(sorted(levels))}"
            )
        if self.attention.weight_min * len(self.aois) > 1 + 1e-9:
            raise ValueError(
                f"attention.weight_min is {self.attention.weight_min}; times {len(self.aois)} AOIs it must not exceed 1"
            )
        if self.attention.distracted_dominance > self.attention.focused_dominance:
            raise ValueError(
                f"attention.distracted_dominance is {self.attention.distracted_dominance}; it must not exceed "
                f"attention.focused_dominance, which is {self.attention.focused_dominance}"
            )
        if self.require_condition and not self.conditions:
            raise ValueError("require_condition is true and the study has no conditions; write conditions, or false")
        for name, overrides in self.conditions.items():
            if fixed := sorted(set(overrides) - CONDITIONAL):
                raise ValueError(
                    f"conditions.{name} overrides {', '.join(fixed)}; it can override {', '.join(sorted(CONDITIONAL))}"
                )
        return self

    @property
    def aoi_names(self) -> tuple[str, ...]:
        """The AOIs' names in the study's order."""
        return tuple(a.name for a in self.aois)


CONDITIONAL: frozenset[str] = frozenset(Study.model_fields) - {
    "study",
    "title",
    "tasks",
    "aois",
    "require_condition",
    "conditions",
}
"""What a condition can override."""

CHANGEABLE: frozenset[str] = frozenset(
    {"scoring", "capacity", "attention", "awareness", "reward", "decider", "learner"}
)
"""What can change while a session runs; of scoring not the strategies' list and levels, of learner not the name."""


def fixed_changes(before: Study, after: Study) -> tuple[str, ...]:
    """The names of what differs between two studies and must not change while a session runs."""
    names = [n for n in Study.model_fields if n not in CHANGEABLE and getattr(before, n) != getattr(after, n)]
    if before.learner.name != after.learner.name:
        names.append("learner.name")
    if list(before.scoring.strategies) != list(after.scoring.strategies):
        names.append("scoring.strategies")
    else:
        names += [
            f"scoring.strategies.{n}.levels"
            for n, s in before.scoring.strategies.items()
            if s.levels != after.scoring.strategies[n].levels
        ]
    return tuple(names)


def merge_patch(target: Any, patch: Any) -> Any:
    """RFC 7386: ``patch`` over ``target``; null removes. Neither is changed."""
    if not isinstance(patch, dict):
        return patch
    merged = dict(target) if isinstance(target, dict) else {}
    for key, value in patch.items():
        if value is None:
            merged.pop(key, None)
        else:
            merged[key] = merge_patch(merged.get(key), value)
    return merged


def _columns(table: dict[str, dict[str, dict[str, float]]], strategies: Any) -> dict[str, Any]:
    """The default table with the columns that the strategies still have."""
    return {
        part: {category: {s: v for s, v in row.items() if s in strategies} for category, row in rows.items()}
        for part, rows in table.items()
    }


def _twice(names: list[str]) -> str:
    return next(name for i, name in enumerate(names) if name in names[:i])


def _not_left_top_right_bottom(name: str, rectangle: list[float]) -> str:
    left, top, width, height = rectangle
    said = f"rectangle of {name} is left, top, right, bottom: left < right and top < bottom; it is {rectangle}"
    if left + width <= 1 and top + height <= 1 and width > 0 and height > 0:
        meant = f"[{left:g}, {top:g}, {left + width:g}, {top + height:g}]"
        return f"{said}; if left, top, width, height are meant, write {meant}"
    return said
