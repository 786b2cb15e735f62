"""The planner for any number of runs at once: its state, and a fold over decisions and results. Pure.

A live session is one run; the simulator folds a thousand. Both make the same steps with the same numbers: values are
rounded before they are compared, so that their last bits, which differ between machines, decide nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from shift_model.vocabulary import GAZES

from shift_learner.learner import Context
from shift_learner.learners.planning import beliefs
from shift_learner.learners.planning.beliefs import Beliefs, Priors
from shift_learner.learners.planning.capacity_model import CapacityModel, capacity_model_of
from shift_learner.learners.planning.lookahead import action_values, outcome_values
from shift_learner.learners.planning.plausible import Bools, Floats, Ints, plausible_people

DECIMALS = 6
"""Values that agree to these decimals are equal, and the first of equal actions is taken."""
NEWEST_WEIGHT = 0.1
"""Weight of the newest result in the share of successes; chosen: about the last ten results."""
TRANSITIONS = np.ones((len(GAZES), len(GAZES))) + np.eye(len(GAZES))
"""Dirichlet prior of the next gaze class; chosen: the same class is a little more probable."""
BLOCK = 64
"""Chosen: the number of runs that are planned at once; their arrays fit into a core's cache."""


class Model(NamedTuple):
    """Everything that follows from the study alone."""

    context: Context
    prior: Priors
    capacity: CapacityModel


@dataclass(frozen=True)
class State:
    """The knowledge about each run, [runs, ...]."""

    beliefs: Beliefs
    capacity: Floats
    previous: Ints
    gaze: Ints
    transitions: Floats
    """Counts of gaze classes, [now, next, runs]."""
    share: Floats
    """Share of successes among recent results, [runs]."""
    decisions: int = 0


def model_of(context: Context) -> Model:
    """Return the planner's model of a study."""
    people = plausible_people(context.study.scoring, context.suggestions)
    prior = beliefs.priors(people, context.study.learner)
    return Model(context, prior, capacity_model_of(context.study))


def initial(model: Model, runs: int) -> State:
    """Return the state before the first decision."""
    nothing = np.full(runs, -1)
    transitions = np.repeat(TRANSITIONS[:, :, None], runs, axis=2)
    capacity = np.full(runs, model.context.study.capacity.start)
    return State(beliefs.initial(model.prior, runs), capacity, nothing, nothing, transitions, np.full(runs, 0.5))


def on_decision(model: Model, state: State, triple: Ints, action: Ints) -> State:
    """Return the state after a decision in each run.

    Capacity moves by the study's equation, after it was corrected to the class that was observed.
    """
    capacity_model, observed = model.capacity, triple // 15
    level = capacity_model.level_of(state.capacity, observed)
    agrees = capacity_model.class_of(state.capacity) == observed
    capacity = np.where(agrees, state.capacity, capacity_model.values[level])
    gaze, transitions = triple // 5 % 3, state.transitions.copy()
    runs = np.flatnonzero(state.gaze >= 0)
    transitions[state.gaze[runs], gaze[runs], runs] += 1
    return replace(
        state,
        capacity=capacity_model.settings.after(capacity, action == state.previous, capacity_model.costs[action]),
        previous=action,
        gaze=gaze,
        transitions=transitions,
        decisions=state.decisions + 1,
    )


def on_result(model: Model, state: State, triple: Ints, action: Ints, success: Bools) -> State:
    """Return the state after a result in each run; a reward above 0 is a success."""
    share = state.share + NEWEST_WEIGHT * (success - state.share)
    return replace(state, beliefs=beliefs.update(state.beliefs, triple, action, success), share=share)


def values_at(model: Model, state: State, triple: Ints) -> Floats:
    """Return the value of each action at a triple in each run, rounded, [runs, actions]."""
    found = [_block_values(model, state, triple, slice(i, i + BLOCK)) for i in range(0, len(triple), BLOCK)]
    return np.concatenate(found).round(DECIMALS)


def values_everywhere(model: Model, state: State) -> Floats:
    """Return the value of each action at each triple of a single run, rounded, [30, actions]."""
    chance, value = _look_ahead(model, state, slice(0, 1))
    triple = np.arange(chance[0].size)
    many = len(triple)
    level = model.capacity.level_of(np.repeat(state.capacity, many), triple // 15)
    found = action_values(
        model.capacity,
        np.broadcast_to(chance, (*chance.shape[:-1], many)),
        np.broadcast_to(value, (*value.shape[:-1], many)),
        level,
        np.repeat(state.previous, many),
        triple,
        model.context.study.learner.planning_discount,
    )
    return found.round(DECIMALS)


def _block_values(model: Model, state: State, triple: Ints, runs: slice) -> Floats:
    chance, value = _look_ahead(model, state, runs)
    level = model.capacity.level_of(state.capacity[runs], triple[runs] // 15)
    discount = model.context.study.learner.planning_discount
    return action_values(model.capacity, chance, value, level, state.previous[runs], triple[runs], discount)


def _look_ahead(model: Model, state: State, runs: slice) -> tuple[Floats, Floats]:
    """Return the probabilities of success, [actions, 2, 3, 5, runs], and the value of each outcome."""
    study = model.context.study
    found = state.beliefs.of(runs).chances
    chance = np.ascontiguousarray(found.transpose(2, 1, 0)).reshape(found.shape[2], 2, 3, 5, -1)
    counts = state.transitions[:, :, runs]
    transitions = counts / counts.sum(axis=1, keepdims=True)
    left = study.interactions - state.decisions - 1
    depth = min(study.learner.planning_horizon, left) if left >= 0 else study.learner.planning_horizon
    discount = study.learner.planning_discount
    return chance, outcome_values(model.capacity, chance, transitions, state.share[runs], depth, discount)
