"""The decider's messages: estimates, decisions and overrides."""

from __future__ import annotations

from pydantic import Field
from shift_model.vocabulary import AwarenessClass, CapacityClass, GazeClass, PolicySource

from shift_schemas.ids import Id
from shift_schemas.messages.base import (
    Author,
    Command,
    Count,
    Fact,
    Message,
    RepeatWording,
    RestRoute,
    Seen,
    Strategy,
    Text,
)


class TripleView(Message):
    """One of the 30 monitoring states."""

    capacity: CapacityClass
    gaze: GazeClass
    awareness: AwarenessClass


class Estimate(Fact):
    """Scores and cognitive state for one task, published when they change."""

    owner = "decider"
    subject = "estimate"

    task: str = Field(description="The task; '' stands for every task without results.")
    observation: TripleView
    scores: dict[str, float] = Field(description="Each strategy's score.")
    cognitive_state: str = Field(description="The state that the scores reduce to.")
    suggested: Strategy = Field(description="The scoring system's action.")


class Versions(Message):
    """The versions of the inputs that a decision was derived from."""

    observation: Count
    policy: Count = Field(description="0: there was no policy.")
    config: Count


class Decision(Fact):
    """The strategy to use, and why."""

    owner = "decider"
    subject = "decision"
    number = "n"

    decision_id: Id
    task: Id
    n: Count = Field(ge=1, description="Number of the decision in its session.")
    strategy: Strategy = Field(description="The strategy to use now, one level each.")
    observation: TripleView
    scores: dict[str, float] = Field(description="Each strategy's score.")
    cognitive_state: str = Field(description="The cognitive state.")
    suggested: Strategy = Field(description="The scoring system's action.")
    actions: list[Strategy] = Field(description="All actions, in their fixed order.")
    probabilities: list[float] = Field(description="The policy's row, per action; sums to 1.")
    propensity: float | None = Field(
        default=None, description="Probability of the chosen strategy; left out for an override."
    )
    explored: bool = Field(description="Whether it is not the greedy action.")
    policy_source: PolicySource = Field(description="learner, last_policy, scoring or override.")
    versions: Versions
    stale: bool = Field(description="Whether the observation had not seen all that it must have.")
    state: str = Field(description="The row of the policy that was drawn from.")
    seed: Count = Field(description="The session's seed; the draw's generator is seeded by (seed, n).")
    required: Seen | None = Field(
        default=None, description="How far the decider had to have read its inputs; left out before format 3."
    )
    override_id: str = Field(default="", description="The override that it follows; '' is no override.")
    reason: str = Field(default="", description="The override's reason.")
    without_override: Strategy | None = Field(
        default=None, description="What SHIFT would have chosen without the override; left out without one."
    )
    gaze_age_s: float | None = Field(
        default=None, description="The age of the newest gaze that it rests on, s; left out without gaze."
    )
    gaze_valid: float | None = Field(
        default=None, description="Share of valid samples in the last two seconds of that gaze, 0..1."
    )
    text: str | None = Field(
        default=None, description="What the robot says; left out: the study has no sentence for it."
    )


class Override(Fact):
    """The strategy that the experimenter chose for a task's next decision, or the withdrawal of such a choice."""

    owner = "decider"
    subject = "override"

    override_id: Id
    task: Id
    strategy: Strategy = Field(description="One level of each strategy; empty for a withdrawal.")
    reason: Text = ""
    withdraws: str = Field(
        default="", description="The override that is withdrawn before a decision used it; '' is none."
    )
    author: Author = Field(default="", description="Who chose it, if the name was given.")


class Decide(Command):
    """Ask for the strategy to use now, and why."""

    owner = "decider"
    procedure = "decide"
    result = Decision
    wait_s = None
    route = RestRoute("POST", "/v1/sessions/{session}/decisions")
    id_field = "decision_id"
    id_prefix = "d-"
    wording = RepeatWording(
        "decision {id} was made before", "request", "Choose another decision_id for another decision"
    )

    task: Id = Field(description="The task that is to be explained.")


class SetOverride(Command):
    """Choose the strategy of the task's next decision, or withdraw such a choice before a decision used it."""

    owner = "decider"
    procedure = "override"
    result = Override
    wait_s = None
    route = RestRoute("POST", "/v1/sessions/{session}/override")
    id_field = "override_id"
    id_prefix = "o-"
    wording = RepeatWording(
        "override {id} was set before", "override", "Choose another override_id for another override"
    )

    added = frozenset({"withdraws", "author"})

    task: Id
    strategy: Strategy = Field(
        default={}, description="One level of each of the study's strategies; left out with withdraws."
    )
    reason: Text = ""
    withdraws: Id | None = Field(default=None, description="The override to withdraw, instead of a strategy.")
    author: Author = Field(default="", description="Your name, for the list of changes.")

    def content(self) -> str:
        """Return the content with the levels sorted: another order is not another override."""
        levels = dict(sorted(self.strategy.items()))
        return Command.content(self.model_copy(update={"strategy": levels}))
