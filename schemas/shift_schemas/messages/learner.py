"""The learner's messages: performances, transitions and policies."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field
from shift_model.vocabulary import LearnerName

from shift_schemas.ids import Id
from shift_schemas.messages.base import (
    Author,
    Command,
    Count,
    Fact,
    Message,
    RepeatWording,
    RestRoute,
    Strategy,
    Warnings,
)
from shift_schemas.messages.decider import Versions


class Result(Message):
    """The result of the task in one dimension."""

    success: bool
    duration_s: Annotated[float, Field(ge=0, le=1e6)] = Field(description="Time to solve it (T), s.")


class ScoredResult(Result):
    """A result and its task performance."""

    value: float = Field(description="success x exp(-decay x duration_s).")


class Performance(Fact):
    """The result of a task, and its reward."""

    owner = "learner"
    subject = "performance"
    number = "n"

    decision_id: Id
    task: Id
    n: Count = Field(ge=1, description="Number of the performance in its session.")
    comprehension: ScoredResult
    enabledness: ScoredResult
    reward: float
    cumulative_reward: float
    corrects: bool = Field(default=False, description="Whether it replaces an earlier report of the same decision.")
    result: Count = Field(
        default=0, description="Which of the task's results it is, from 1; a correction has that of the first report."
    )
    warnings: Warnings = Field(default=[], description="What was accepted but may be a mistake.")
    author: Author = Field(default="", description="Who entered it by hand, if the name was given.")


class Transition(Fact):
    """What the learner learned from: state, action, reward."""

    owner = "learner"
    subject = "transition"

    decision_id: Id
    task: Id
    state: str = Field(description="The row that was updated.")
    action: Strategy
    reward: float
    propensity: float | None = Field(default=None, description="Left out if the action was an override.")
    versions: Versions
    value: float = Field(description="The row's value of the action after the update.")


class PolicyRow(Message):
    """The policy in one state."""

    probabilities: list[float] = Field(description="Per action; sums to 1.")
    values: list[float] = Field(description="The values that the probabilities follow from, per action.")
    visits: list[Count] = Field(description="Reported decisions per action.")


class Policy(Fact):
    """Action probabilities for each state, for one decision number."""

    owner = "learner"
    subject = "policy"
    number = "version"

    version: Count = Field(ge=1)
    learner: LearnerName
    for_n: Count = Field(ge=1, description="The number of the decision that it is for.")
    actions: list[Strategy]
    states: dict[str, PolicyRow]
    epsilon: float | None = Field(default=None, description="Probability of exploring, if the learner has one.")
    cumulative_reward: float = 0.0


class PerformanceBody(Message):
    """Report how the task went."""

    decision_id: Id = Field(description="The decision that it was done after.")
    comprehension: Result
    enabledness: Result
    corrects: bool = Field(default=False, description="Replace the decision's earlier report; both are recorded.")
    author: Author = Field(default="", description="Your name, if you enter the result by hand.")


class ReportPerformance(Command):
    """Report how the task went."""

    # ``command_id`` is the decision's id; a correction has an id of its own, and names the decision in ``corrects``.
    owner = "learner"
    procedure = "report_performance"
    result = Performance
    wait_s = 2.0
    route = RestRoute("POST", "/v1/sessions/{session}/performance")
    id_field = "decision_id"
    body = PerformanceBody
    wording = RepeatWording(
        "decision {id} has its report already",
        "report",
        'To replace the first report, send this one with "corrects": true; for another decision, send that '
        "decision's decision_id",
    )

    added = frozenset({"corrects", "author"})

    comprehension: Result
    enabledness: Result
    corrects: Id | None = Field(default=None, description="The decision whose report this one replaces.")
    author: Author = ""

    @property
    def decision_id(self) -> str:
        """The decision that is reported."""
        return self.corrects or self.command_id

    @classmethod
    def id_in(cls, body: PerformanceBody) -> str | None:
        """Return the decision's id; None for a correction, which needs a new one."""
        return None if body.corrects else body.decision_id

    @classmethod
    def fields_in(cls, body: PerformanceBody) -> dict[str, Any]:
        """Return both results, and the decision that a correction is about."""
        corrects = body.decision_id if body.corrects else None
        return {
            "comprehension": body.comprehension, "enabledness": body.enabledness, "corrects": corrects,
            "author": body.author,
        }  # fmt: skip

    @classmethod
    def answer_in(cls, result: dict[str, Any]) -> dict[str, Any]:
        """Return the performance with each dimension's value alone."""
        return result | {name: result[name]["value"] for name in ("comprehension", "enabledness")}
