"""The study file: what a researcher configures.

Defaults, ranges and the settings that can change while a session runs: docs/interface.md, "Study file".
"""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field, field_validator, model_validator
from shift_model.thresholds import MARGIN
from shift_schemas.ids import Id

from shift_study.areas import Aoi
from shift_study.constants import (
    AttentionSettings,
    AwarenessSettings,
    CapacitySettings,
    DeciderSettings,
    FixationSettings,
    RewardSettings,
)
from shift_study.fields import StimulusFile, StudyPart
from shift_study.learner_settings import LearnerSettings
from shift_study.phrase_checks import phrase_mistakes
from shift_study.phrases import PhrasesSettings
from shift_study.scoring_table import ScoringSettings, strategy_name


class Study(StudyPart):
    """A complete study."""

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
    blinded: bool = Field(
        default=False, description="Whether the web page hides the condition while a session runs; chosen: no."
    )
    stimulus: StimulusFile | None = Field(
        default=None, description="Image that the web page draws under the AOIs: a file in the folder of the studies."
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
    phrases: PhrasesSettings | None = Field(
        default=None, description="What the robot says; left out: a decision has no text."
    )

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
        if self.attention.weight_min * len(self.aois) > 1 + MARGIN:
            raise ValueError(
                f"attention.weight_min is {self.attention.weight_min}; times {len(self.aois)} AOIs it must not exceed 1"
            )
        if self.attention.distracted_dominance > self.attention.focused_dominance:
            raise ValueError(
                f"attention.distracted_dominance is {self.attention.distracted_dominance}; it must not exceed "
                f"attention.focused_dominance, which is {self.attention.focused_dominance}"
            )
        if (least := self.decider.minimum_propensity) * len(self.scoring.actions) > 1 + MARGIN:
            raise ValueError(
                f"decider.minimum_propensity is {least}; times {len(self.scoring.actions)} actions it must not exceed 1"
            )
        self._check_prior()
        if self.require_condition and not self.conditions:
            raise ValueError("require_condition is true and the study has no conditions; write conditions, or false")
        for name, overrides in self.conditions.items():
            if fixed := sorted(set(overrides) - CONDITIONAL):
                raise ValueError(
                    f"conditions.{name} overrides {', '.join(fixed)}; it can override {', '.join(sorted(CONDITIONAL))}"
                )
        if self.phrases is not None:
            for mistake in phrase_mistakes(self.phrases, self.tasks, self.scoring):
                raise ValueError(mistake)
        return self

    def _check_prior(self) -> None:
        """Raise ValueError if ``learner.prior`` names a state or a strategy that the study does not have."""
        states, names = self.scoring.states, [strategy_name(choice) for choice in self.scoring.choices]
        for state, shares in (self.learner.prior or {}).items():
            if state not in states:
                raise ValueError(f"learner.prior has the state {state!r}; the study has {', '.join(states)}")
            if unknown := [name for name in shares if name not in names]:
                raise ValueError(
                    f"learner.prior.{state} has the strategy {unknown[0]!r}; the study has {', '.join(names)}"
                )

    @property
    def aoi_names(self) -> tuple[str, ...]:
        """The names of the AOIs in the study's order."""
        return tuple(a.name for a in self.aois)


CONDITIONAL: frozenset[str] = frozenset(Study.model_fields) - {
    "study",
    "title",
    "tasks",
    "aois",
    "require_condition",
    "blinded",
    "stimulus",
    "conditions",
}
"""What a condition can override."""


CHANGEABLE: frozenset[str] = frozenset(
    {"scoring", "capacity", "attention", "awareness", "reward", "decider", "learner"}
)
"""What can change while a session runs; of scoring not the strategies' list and levels, of learner not the name."""


def fixed_changes(before: Study, after: Study) -> tuple[str, ...]:
    """Return the names of settings that differ between two studies and must not change while a session runs."""
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


def _twice(names: list[str]) -> str:
    return next(name for i, name in enumerate(names) if name in names[:i])
