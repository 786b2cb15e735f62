"""Plausible people: the hypotheses of the planner before the first interaction. Pure.

The planner knows the scoring system, never the person. A person may differ from the system in two ways:

- *wrong entries*: entries of the scoring table are flipped, each with a small probability. One strategy then has
  2**10 possible columns; each column gives the level that suits each triple. All of them are kept, for every strategy.
- *a preference*: the scoring table is right except for a group of actions (one level of a strategy, or this level and
  all above). Their success does not depend on the suggestion: they succeed if and only if capacity, gaze and
  awareness each are in some subset of their classes. The subsets of awareness are single classes, all classes but
  one, and those that the table's own column marks alike; 100 interactions could not tell all 31 subsets apart.
"""

from __future__ import annotations

from itertools import combinations, product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from shift_model.scoring import level_index, scaffolding_score
from shift_model.vocabulary import AWARENESSES, CAPACITIES, GAZES, TRIPLES
from shift_study.study import ScoringSettings, StrategySettings

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

MOST_ENTRIES = 4_000_000
"""Chosen: the most entries of the preferences' table (32 MB); beyond, a preference uses one feature only."""

_PARTS = (("capacity", CAPACITIES), ("gaze", GAZES), ("awareness", AWARENESSES))
CATEGORIES: tuple[tuple[str, str], ...] = tuple((part, name) for part, names in _PARTS for name in names)
"""The ten rows of the scoring table."""


class Columns(NamedTuple):
    """All columns of the scoring table that one strategy can have, with any entries flipped."""

    suits: Floats
    """[columns, 30 x levels]: 1 where the level is the one that the column suggests for the triple."""
    suits_by_level: Floats
    """The transposed array: the entries that one result needs of all columns are contiguous."""
    flips: Ints
    """[columns]: how many entries differ from the study's table."""
    levels: int


class Preferences(NamedTuple):
    """People for whom the table is right except for one group of actions."""

    success: Floats
    """[preferences, 30 x actions]: 1 where the action succeeds."""
    success_by_cell: Floats
    """The transposed array."""
    prior: Floats
    """[preferences], sums to 1."""


class Plausible(NamedTuple):
    """All plausible people around one scoring system."""

    levels: Ints
    """[actions, strategies]: each action's levels."""
    columns: tuple[Columns, ...]
    preferences: Preferences


def plausible_people(scoring: ScoringSettings, suggested: tuple[int, ...]) -> Plausible:
    """Return all plausible people around this scoring system."""
    levels = np.array(list(product(*(range(len(s.levels)) for s in scoring.strategies.values()))))
    columns = tuple(_columns(scoring, name, settings) for name, settings in scoring.strategies.items())
    return Plausible(levels, columns, _preferences(scoring, levels, suggested))


# --- wrong entries ---


def _columns(scoring: ScoringSettings, name: str, strategy: StrategySettings) -> Columns:
    flipped = np.array(list(product((0, 1), repeat=len(CATEGORIES))))
    entries = np.abs(_column(scoring, name) - flipped)
    parts = [part for part, _ in _PARTS]
    rows = np.array([[CATEGORIES.index(c) for c in zip(parts, t, strict=True)] for t in TRIPLES])
    scores = scaffolding_score(entries[:, rows], strategy.weight, scoring.s_max)
    levels = level_index(scores, strategy.thresholds)
    suits = (levels[:, :, None] == np.arange(len(strategy.levels))).reshape(len(flipped), -1).astype(np.float64)
    return Columns(suits, np.ascontiguousarray(suits.T), flipped.sum(axis=1), len(strategy.levels))


def _column(scoring: ScoringSettings, name: str) -> Floats:
    """Return one strategy's entries for the ten rows."""
    return np.array([getattr(getattr(scoring.table, part), category)[name] for part, category in CATEGORIES])


# --- a preference ---


def _preferences(scoring: ScoringSettings, levels: Ints, suggested: tuple[int, ...]) -> Preferences:
    groups = _groups(levels)
    conditions = _conditions(scoring)
    if len(groups) * len(conditions) * len(TRIPLES) * len(levels) > MOST_ENTRIES:
        conditions = [c for c in conditions if c.features <= 1]
    right = np.zeros((len(TRIPLES), len(levels)))
    right[np.arange(len(TRIPLES)), list(suggested)] = 1.0
    tables = np.repeat(right[None], len(groups) * len(conditions), axis=0).reshape(len(groups), -1, *right.shape)
    holds = np.array([c.holds for c in conditions], dtype=np.float64)
    for table, group in zip(tables, groups, strict=True):
        table[:, :, group] = holds[:, :, None]
    prior = np.tile([c.prior for c in conditions], len(groups))
    success = tables.reshape(len(prior), -1)
    return Preferences(success, np.ascontiguousarray(success.T), prior / prior.sum())


def _groups(levels: Ints) -> list[Ints]:
    """Return the actions with one level of a strategy, and those with a level or any above it, as indices."""
    groups = []
    for column in levels.T:
        count = int(column.max()) + 1
        sets = [{level} for level in range(count)] + [set(range(k, count)) for k in range(1, count - 1)]
        groups += [np.flatnonzero(np.isin(column, list(s))) for s in sets]
    return groups


class Condition(NamedTuple):
    """The triples at which the actions of a preference succeed."""

    holds: Bools
    """[30]"""
    prior: float
    features: int
    """How many of the three features it depends on."""


def _conditions(scoring: ScoringSettings) -> list[Condition]:
    """Return all conditions.

    A condition depends on each feature with probability one half; all subsets of the classes are equally probable.
    """
    capacity = [set(s) for n in (1, 2) for s in combinations(range(2), n)]
    gaze = [set(s) for n in (1, 2, 3) for s in combinations(range(3), n)]
    found = []
    for subsets in product(capacity, gaze, _awareness_subsets(scoring)):
        masks = [np.isin(np.arange(n), list(s)) for n, s in zip((2, 3, 5), subsets, strict=True)]
        holds = masks[0][:, None, None] & masks[1][:, None] & masks[2]
        used = [not mask.all() for mask in masks]
        counts = (len(capacity), len(gaze), len(_awareness_subsets(scoring)))
        prior = float(np.prod([0.5 / (n - 1) if uses else 0.5 for uses, n in zip(used, counts, strict=True)]))
        found.append(Condition(holds.reshape(-1), prior, sum(used)))
    return found


def _awareness_subsets(scoring: ScoringSettings) -> list[set[int]]:
    every = frozenset(range(len(AWARENESSES)))
    columns = [_column(scoring, name)[-len(AWARENESSES) :] for name in scoring.strategies]
    marked = [frozenset(np.flatnonzero(column >= 0.5).tolist()) for column in columns]
    sets = [frozenset({a}) for a in every] + marked
    both = [s for part in sets for s in (part, every - part) if s and s != every]
    return [set(s) for s in dict.fromkeys([*both, every])]
