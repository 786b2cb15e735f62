"""The planner: beliefs about the person, and a look-ahead over the model's capacity equation.

It knows the scoring system, never the person. Its parts are in ``planning``: the plausible people, the posterior over
them with counts as the fallback, and the value iteration. It always takes the best action by the posterior's mean and
never explores on purpose (measured: a bonus for uncertainty costs reward).

Its memory is the history of decisions and results; everything else follows from the history and the study in force.
After a restart or a change of the study's settings, the history is folded again.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from shift_model.vocabulary import TRIPLES
from shift_study.loading import study_json, study_of

from shift_learner.learner import Context, DecisionView, Row
from shift_learner.learners.planning.engine import (
    Model,
    State,
    initial,
    model_of,
    on_decision,
    on_result,
    values_everywhere,
)
from shift_learner.learners.planning.plausible import Ints

Event = tuple[int, ...]
"""(triple, action) for a decision; (triple, action, success) for its result."""


@lru_cache(maxsize=8)
def _model_of(study: str) -> Model:
    """Return the model of a study given as text; sessions of one study share it."""
    return model_of(Context(study_of(json.loads(study))))


@dataclass(frozen=True)
class Memory:
    """The history, and the beliefs that follow from it under ``context``."""

    context: Context
    model: Model
    state: State
    visits: Ints
    """Reported decisions, [30, actions]."""
    history: tuple[Event, ...] = ()

    @cached_property
    def values(self) -> list[list[float]]:
        """The value of each action at each triple, planned at its first use."""
        values: list[list[float]] = values_everywhere(self.model, self.state).tolist()
        return values


class Planner:
    """A learner that plans by value iteration over its beliefs."""

    name = "planner"
    on_triples = True

    def initial(self, context: Context) -> Memory:
        """Return an empty history."""
        model = _model_of(study_json(context.study))
        return Memory(context, model, initial(model, 1), np.zeros((len(TRIPLES), context.actions), np.int64))

    def on_decision(self, context: Context, memory: Memory, taken: DecisionView) -> Memory:
        """Move capacity and count the gaze class."""
        return _after(_under(context, memory), (taken.triple, taken.action))

    def on_reward(
        self, context: Context, memory: Memory, taken: DecisionView, reward: float, following: DecisionView | None
    ) -> Memory:
        """Update the beliefs; a reward above 0 is a success."""
        return _after(_under(context, memory), (taken.triple, taken.action, int(reward > 0)))

    def needs_following(self, context: Context) -> bool:
        """Return False: the planner never waits for the next decision."""
        return False

    def row(self, context: Context, memory: Memory, state: int) -> Row:
        """Put all probability on the best action, the first one of equal values."""
        memory = _under(context, memory)
        values = memory.values[state]
        best = values.index(max(values))
        return Row([float(a == best) for a in range(len(values))], list(values), memory.visits[state].tolist())

    def epsilon(self, context: Context, memory: Memory) -> None:
        """Return None: there is no exploration rate."""

    def dump(self, memory: Memory) -> Any:
        """Return the history."""
        return memory.history

    def load(self, context: Context, data: Any) -> Memory:
        """Fold the history again."""
        memory: Memory = self.initial(context)
        for event in data:
            memory = _after(memory, tuple(event))
        return memory


def _under(context: Context, memory: Memory) -> Memory:
    """Return the memory under the study in force; if the study changed, fold the history again."""
    if memory.context is context or memory.context == context:
        return memory
    return Planner().load(context, memory.history)


def _after(memory: Memory, event: Event) -> Memory:
    triple, action = np.array(event[:1]), np.array(event[1:2])
    history = (*memory.history, event)
    if len(event) == 2:
        return replace(memory, state=on_decision(memory.model, memory.state, triple, action), history=history)
    visits = memory.visits.copy()
    visits[event[0], event[1]] += 1
    state = on_result(memory.model, memory.state, triple, action, np.array([event[2] == 1]))
    return replace(memory, state=state, visits=visits, history=history)
