"""What a door is asked, where that is not a message of the mesh itself: one set for REST and ROS 2. Pure."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, RootModel

from shift_schemas.ids import Id
from shift_schemas.messages import JsonObject, Message, Result, Strategy, Text


class StartBody(Message):
    """Begin a session."""

    participant: Id = Field(description="Pseudonym of the participant.")
    session: Id | None = Field(default=None, description="Left out: a new id.")
    study: Id | JsonObject = Field(default="default", description="A study's name, or the study itself.")
    seed: Annotated[int, Field(ge=0, lt=2**53)] | None = Field(default=None, description="Left out: from the id.")
    condition: Id | None = Field(default=None, description="Left out: the study's own values.")


class PatchBody(RootModel[JsonObject]):
    """Change the study in force: a JSON merge patch (RFC 7386) of it."""


class DecisionBody(Message):
    """Ask for the strategy to use now."""

    task: Id = Field(description="The task that is to be explained.")
    decision_id: Id | None = Field(default=None, description="Your id for it; a repeat gets the first result.")


class PerformanceBody(Message):
    """Report how the task went."""

    decision_id: Id = Field(description="The decision that it was done after.")
    comprehension: Result
    enabledness: Result
    corrects: bool = Field(default=False, description="Replace the decision's earlier report; both are recorded.")


class OverrideBody(Message):
    """Choose the strategy of the task's next decision yourself."""

    task: Id
    strategy: Strategy = Field(description="One level of each of the study's strategies.")
    reason: Text = ""
    override_id: Id | None = None


class MarkerBody(Message):
    """Note something in the recording."""

    text: Text
    marker_id: Id | None = None
