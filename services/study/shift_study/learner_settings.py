"""The settings of each learner.

To add a learner's settings, write a class of its parameters, add it to the bases of :class:`LearnerSettings`, and add
its entry in ``LEARNER_SETTINGS``. A learner without an entry has no parameters. A parameter that several learners read
stands in a class of its own. The study file holds the parameters of all learners side by side, in the order in which
recordings of every version have them; the order of the bases gives it, from the last to the first.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field
from shift_model.vocabulary import LearnerName

from shift_study.fields import Probability, StudyPart


class LearnerChoice(StudyPart):
    """The name of the learner; a learner without parameters has nothing more."""

    name: LearnerName = Field(default="q-learning", description="The learner; fixed for a session.")
    paused: bool = Field(
        default=False, description="Whether reports are recorded without being learned from; any learner."
    )


# --- parameters that several learners read ---


class _Epsilon(LearnerChoice):
    epsilon: Probability = Field(default=0.75, description="ε at the start, falling to 0; paper.")


class _ScoringPrior(LearnerChoice):
    scoring_prior: bool = Field(default=True, description="Whether the scoring system's suggestion is the prior.")


class _PriorValue(LearnerChoice):
    prior_value: Annotated[float, Field(ge=0, le=100)] = Field(
        default=1.0, description="Q0 of the suggested action; fitted."
    )


class _PriorStrength(LearnerChoice):
    prior_strength: Annotated[float, Field(ge=0, le=100)] = Field(
        default=4.0, description="Imagined results behind the scoring prior: thompson, linear-thompson; chosen."
    )


class _PriorTable(LearnerChoice):
    prior: dict[str, dict[str, Probability]] | None = Field(
        default=None,
        description="Shares of strategies by cognitive state, in place of the scoring prior; or the name of a JSON "
        "file beside the study file, as whatif writes it (wizard.json).",
    )


# --- one class for each learner; its own parameters first ---


class _LearningRate(LearnerChoice):
    learning_rate: Probability = Field(default=0.25, description="α of q-learning; paper.")
    discount: Probability = Field(default=0.0, description="γ of q-learning; paper.")


class QLearningSettings(_PriorTable, _PriorValue, _ScoringPrior, _Epsilon, _LearningRate):
    """Tabular Q-learning, the paper's learner."""


class EpsilonGreedySettings(_PriorTable, _PriorValue, _ScoringPrior, _Epsilon):
    """Epsilon-greedy over mean rewards."""


class _Exploration(LearnerChoice):
    exploration: Annotated[float, Field(ge=0, le=100)] = Field(
        default=1.0, description="Width of ucb1's bonus, in units of its sqrt(2 ln n / visits); Auer et al. 2002."
    )


class Ucb1Settings(_Exploration, _PriorTable, _PriorValue, _ScoringPrior):
    """Upper confidence bounds (UCB1)."""


class _ThompsonStates(LearnerChoice):
    thompson_states: Literal["cognitive", "triples"] = Field(
        default="cognitive", description="What thompson keeps a posterior for: six states or 30 triples; chosen."
    )


class ThompsonSettings(_PriorTable, _PriorStrength, _ThompsonStates, _ScoringPrior):
    """Thompson sampling with Beta posteriors."""


class _Noise(LearnerChoice):
    noise: Annotated[float, Field(gt=0, le=100)] = Field(
        default=0.5, description="Standard deviation of a reward around linear-thompson's line; chosen."
    )


class LinearThompsonSettings(_Noise, _PriorStrength, _PriorValue, _ScoringPrior):
    """Thompson sampling with a linear model."""


class _Planning(LearnerChoice):
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


class PlannerSettings(_Planning, _ScoringPrior):
    """The planner: a model of the person and a look ahead."""


class LearnerSettings(
    PlannerSettings, LinearThompsonSettings, ThompsonSettings, Ucb1Settings, EpsilonGreedySettings, QLearningSettings
):
    """The learner of a study and the parameters of all learners. A learner ignores parameters that it does not read."""


LEARNER_SETTINGS: dict[str, type[LearnerChoice]] = {
    "scoring": LearnerChoice,
    "q-learning": QLearningSettings,
    "epsilon-greedy": EpsilonGreedySettings,
    "ucb1": Ucb1Settings,
    "thompson": ThompsonSettings,
    "linear-thompson": LinearThompsonSettings,
    "planner": PlannerSettings,
}
"""The class that holds the parameters of each learner."""


COMMON = frozenset(LearnerChoice.model_fields)
"""What every learner has: its name, and whether it is paused."""


def parameters_of(learner: str) -> frozenset[str]:
    """Return the parameters that the learner of this name reads."""
    return frozenset(LEARNER_SETTINGS.get(learner, LearnerChoice).model_fields) - COMMON
