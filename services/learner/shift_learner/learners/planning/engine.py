"""The planner for any number of runs at once: state, and a fold over decisions and results. Pure.

Live there is one run; the simulator folds a thousand. Both take the same steps on the same numbers: values are
rounded before they are compared, so that the last bits, in which machines differ, do not decide.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from shift_model.vocabulary import GAZES

from shift_learner.learner import Context
from shift_learner.learners.planning.beliefs import Beliefs, Priors, priors, started, told
from shift_learner.learners.planning.lookahead import Battery, action_values, ahead, battery_of, level_of
from shift_learner.learners.planning.plausible import Bools, Floats, Ints, plausible_people

DECIMALS = 6
"""Values that agree to these are a tie, and the first action is taken."""
LATELY = 0.1
"""Weight of the newest result in the share of successes; chosen: about the last ten."""
TURNS = np.ones((len(GAZES), len(GAZES))) + np.eye(len(GAZES))
"""Dirichlet prior of how the gaze class goes on; chosen: a little more probable to stay."""
BLOCK = 64
"""Runs that are planned for at once; chosen: their arrays fit into a core's cache."""


class Model(NamedTuple):
    """What follows from the study alone."""

    context: Context
    prior: Priors
    battery: Battery


@dataclass(frozen=True)
class State:
    """What is known of each run, [runs, ...]."""

    beliefs: Beliefs
    capacity: Floats
    previous: Ints
    gaze: Ints
    turns: Floats
    """Counts, [now, next, runs]."""
    share: Floats
    decisions: int = 0


def model_of(context: Context) -> Model:
    """The planner's model of a study."""
    people = plausible_people(context.study.scoring, context.suggestions)
    return Model(context, priors(people, context.study.learner), battery_of(context.study))


def start(model: Model, runs: int) -> State:
    """Nothing decided yet."""
    nobody = np.full(runs, -1)
    turns = np.repeat(TURNS[:, :, None], runs, axis=2)
    capacity = np.full(runs, model.context.study.capacity.start)
    return State(started(model.prior, runs), capacity, nobody, nobody, turns, np.full(runs, 0.5))


def decided(model: Model, state: State, triple: Ints, action: Ints) -> State:
    """A decision in each run: capacity by the study's equation, set right by the class that was observed."""
    level = level_of(model.battery, state.capacity, triple // 15)
    high = (state.capacity >= model.context.study.capacity.threshold - 1e-9).astype(np.int64)
    capacity = np.where(high == triple // 15, state.capacity, model.battery.values[level])
    gaze, turns = triple // 5 % 3, state.turns.copy()
    runs = np.flatnonzero(state.gaze >= 0)
    turns[state.gaze[runs], gaze[runs], runs] += 1
    return replace(
        state,
        capacity=_executed(model, capacity, state.previous, action),
        previous=action,
        gaze=gaze,
        turns=turns,
        decisions=state.decisions + 1,
    )


def _executed(model: Model, capacity: Floats, previous: Ints, action: Ints) -> Floats:
    s = model.context.study.capacity
    demanding = set(s.demanding)
    actions = model.context.study.scoring.actions
    costs = np.array([s.demanding_cost if demanding & set(a) else s.other_cost for a in actions])
    spent = np.maximum(capacity - costs[action], s.min)
    return np.where(action == previous, np.minimum(capacity + s.recovery, s.max), spent)


def rewarded(model: Model, state: State, triple: Ints, action: Ints, success: Bools) -> State:
    """A result in each run; a reward above 0 is a success."""
    share = state.share + LATELY * (success - state.share)
    return replace(state, beliefs=told(state.beliefs, triple, action, success), share=share)


def values_at(model: Model, state: State, triple: Ints) -> Floats:
    """The value of each action at a triple in each run, rounded, [runs, actions]."""
    found = [_block(model, state, triple, slice(i, i + BLOCK)) for i in range(0, len(triple), BLOCK)]
    return np.concatenate(found).round(DECIMALS)


def _block(model: Model, state: State, triple: Ints, runs: slice) -> Floats:
    chance, value = _ahead(model, state, runs)
    level = level_of(model.battery, state.capacity[runs], triple[runs] // 15)
    discount = model.context.study.learner.planning_discount
    return action_values(model.battery, chance, value, level, state.previous[runs], triple[runs], discount)


def values_everywhere(model: Model, state: State) -> Floats:
    """The value of each action at each triple of a single run, rounded, [30, actions]."""
    chance, value = _ahead(model, state, slice(0, 1))
    triple = np.arange(chance[0].size)
    many = len(triple)
    level = level_of(model.battery, np.repeat(state.capacity, many), triple // 15)
    found = action_values(
        model.battery,
        np.broadcast_to(chance, (*chance.shape[:-1], many)),
        np.broadcast_to(value, (*value.shape[:-1], many)),
        level,
        np.repeat(state.previous, many),
        triple,
        model.context.study.learner.planning_discount,
    )
    return found.round(DECIMALS)


def _ahead(model: Model, state: State, runs: slice) -> tuple[Floats, Floats]:
    """Chances of success [actions, 2, 3, 5, runs], and what lies ahead of each outcome."""
    study = model.context.study
    found = state.beliefs.of(runs).chances
    chance = np.ascontiguousarray(found.transpose(2, 1, 0)).reshape(found.shape[2], 2, 3, 5, -1)
    turns = state.turns[:, :, runs]
    turns = turns / turns.sum(axis=1, keepdims=True)
    left = study.interactions - state.decisions - 1
    depth = min(study.learner.planning_horizon, left) if left >= 0 else study.learner.planning_horizon
    return chance, ahead(model.battery, chance, turns, state.share[runs], depth, study.learner.planning_discount)
