"""The parameters that a learner reads are those that the study's warnings list for it."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import pytest
from shift_learner.learner import Context, DecisionView
from shift_learner.learners import LEARNERS, planner
from shift_learner.learners.planning.engine import model_of
from shift_study.learner_settings import LearnerSettings, parameters_of
from shift_study.study import Study


class Watched(LearnerSettings):
    """Settings that record which of them are read."""

    def __getattribute__(self, name: str) -> Any:
        if name in LearnerSettings.model_fields and name != "name":
            READ.add(name)
        return super().__getattribute__(name)


READ: set[str] = set()


@pytest.mark.parametrize("name", LEARNERS)
def test_learner_reads_exactly_the_parameters_that_are_listed_for_it(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    READ.clear()
    settings = Watched(name=name, discount=0.5)
    context = Context(Study(study="watched").model_copy(update={"learner": settings}))
    monkeypatch.setattr(planner, "_model_of", lambda study: model_of(context))  # it reads the study's text otherwise
    learner = LEARNERS[name]
    memory = learner.initial(context)
    taken = [DecisionView(t + 1, t, context.suggestions[t], action=1, propensity=0.5) for t in range(6)]
    for one, following in pairwise(taken):
        learner.row(context, memory, one.triple if learner.on_triples else one.cognitive_state)
        learner.epsilon(context, memory)
        learner.needs_following(context)
        memory = learner.on_decision(context, memory, one)
        memory = learner.on_reward(context, memory, one, 0.5, following)
    assert parameters_of(name) == READ
