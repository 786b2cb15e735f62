"""The constants of the model, one class for each part of it.

A value marked *paper* is from the paper (arXiv 2503.16447); every other default is chosen or fitted, as its
description says.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated, Any, Literal, overload

from pydantic import Field, model_validator
from shift_model.capacity import next_capacity, strategy_cost

from shift_study.fields import Level, NonNegative, Positive, Probability, StudyPart

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


class CapacitySettings(StudyPart):
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

    def cost_of(self, levels: Iterable[str]) -> float:
        """Return the cost of a strategy with these levels (:func:`shift_model.capacity.strategy_cost`)."""
        return strategy_cost(levels, self.demanding, self.demanding_cost, self.other_cost)

    @overload
    def after(self, value: float, repeated: bool, cost: float) -> float: ...
    @overload
    def after(self, value: NDArray[Any], repeated: Any, cost: Any) -> NDArray[np.float64]: ...
    def after(self, value: Any, repeated: Any, cost: Any) -> Any:
        """Return the capacity after one executed strategy (:func:`shift_model.capacity.next_capacity`)."""
        return next_capacity(value, repeated, cost, recovery=self.recovery, minimum=self.min, maximum=self.max)


class AttentionSettings(StudyPart):
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


class FixationSettings(StudyPart):
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


class AwarenessSettings(StudyPart):
    """Task awareness: success ratios over the last results (paper, section III-A3)."""

    window: int = Field(default=1, ge=1, le=10_000, description="How many of the last results count; chosen.")
    threshold: Probability = Field(default=0.5, description="A ratio at or above it is fine; chosen.")


class RewardSettings(StudyPart):
    """The reward function (paper, section III-E)."""

    decay: NonNegative = Field(default=0.1, description="k of exp(-k T), per second; paper.")
    scale: NonNegative = Field(default=1.0, description="λ, the factor of the mean of both dimensions; paper.")


class DeciderSettings(StudyPart):
    """How a decision comes about."""

    wait_s: Annotated[float, Field(ge=0, le=300)] = Field(
        default=2.0, description="How long a decision waits until your earlier data is processed, s; 0 never waits."
    )
    minimum_propensity: Probability = Field(
        default=0.0,
        description="Least probability of each action, so that what-if can judge other policies; 0 changes nothing.",
    )
