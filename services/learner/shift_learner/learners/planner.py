"""The planner: beliefs about who the person is, and a look ahead over the model's capacity equation.

It knows the scoring system, never the person. ``planning`` holds its parts: the people that it holds possible,
the posterior over them with a fallback to what is observed, and the value iteration. It always takes the best
action by the posterior's mean; it explores nothing on purpose (measured: a bonus for uncertainty costs reward).

Its memory is the history of decisions and results; everything else follows from it and the study in force. So a
restart, a journal and a change of the study's settings all mean the same: the history is folded again.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from shift_model.vocabulary import TRIPLES
from shift_study.loading import study_json, study_of

from shift_learner.learner import Context, Row, Taken
from shift_learner.learners.planning.engine import Model, State, decided, model_of, rewarded, start, values_everywhere
from shift_learner.learners.planning.plausible import Ints

Event = tuple[int, ...]
"""(triple, action) is a decision; (triple, action, success) its result."""


@lru_cache(maxsize=8)
def _model_of(study: str) -> Model:
    """The model of a study given as text; sessions of one study share it."""
    return model_of(Context(study_of(json.loads(study))))


@dataclass(frozen=True)
class Memory:
    """The history, and what it makes of the person under ``context``."""

    context: Context
    model: Model
    state: State
    visits: Ints
    """Reported decisions, [30, actions]."""
    history: tuple[Event, ...] = ()

    @cached_property
    def values(self) -> list[list[float]]:
        """The value of each action at each triple, planned when it is first asked for."""
        values: list[list[float]] = values_everywhere(self.model, self.state).tolist()
        return values


class Planner:
    """See the module."""

    name = "planner"
    on_triples = True

    def initial(self, context: Context) -> Memory:
        """Nobody met."""
        model = _model_of(study_json(context.study))
        return Memory(context, model, start(model, 1), np.zeros((len(TRIPLES), context.actions), np.int64))

    def decided(self, context: Context, memory: Memory, taken: Taken) -> Memory:
        """Capacity moves, gaze is counted."""
        return _after(_under(context, memory), (taken.triple, taken.action))

    def rewarded(
        self, context: Context, memory: Memory, taken: Taken, reward: float, following: Taken | None
    ) -> Memory:
        """Beliefs move; a reward above 0 is a success."""
        return _after(_under(context, memory), (taken.triple, taken.action, int(reward > 0)))

    def needs_following(self, context: Context) -> bool:
        """Never: it plans."""
        return False

    def row(self, context: Context, memory: Memory, state: int) -> Row:
        """All probability on the best action, the first of equals."""
        memory = _under(context, memory)
        values = memory.values[state]
        best = values.index(max(values))
        return Row([float(a == best) for a in range(len(values))], list(values), memory.visits[state].tolist())

    def epsilon(self, context: Context, memory: Memory) -> None:
        """It does not explore at random."""

    def dump(self, memory: Memory) -> Any:
        """The history."""
        return memory.history

    def load(self, context: Context, data: Any) -> Memory:
        """The history folded again."""
        memory: Memory = self.initial(context)
        for event in data:
            memory = _after(memory, tuple(event))
        return memory


def _under(context: Context, memory: Memory) -> Memory:
    """The memory under the study in force: where that changed, the history is folded again."""
    if memory.context is context or memory.context == context:
        return memory
    return Planner().load(context, memory.history)


def _after(memory: Memory, event: Event) -> Memory:
    triple, action = np.array(event[:1]), np.array(event[1:2])
    history = (*memory.history, event)
    if len(event) == 2:
        return replace(memory, state=decided(memory.model, memory.state, triple, action), history=history)
    visits = memory.visits.copy()
    visits[event[0], event[1]] += 1
    state = rewarded(memory.model, memory.state, triple, action, np.array([event[2] == 1]))
    return replace(memory, state=state, visits=visits, history=history)
