"""The exact optimum for a simulated user, for a policy that knows the user: finite-horizon dynamic programming.

Pure. The state has everything that affects the future: the estimated capacity, the true capacity if it differs, the
previous action, the gaze class, the awareness of every task, and the time left. Tasks are alike, so the state holds
only how many of them are unknown, failed and done. The other two awareness classes do not occur, because the window
is 1 and both dimensions have the same simulated outcome. The values of capacity are enumerated, not put on a grid.
The expectation of the reward over durations and coin flips is exact.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray
from shift_model.capacity import is_high
from shift_model.vocabulary import AWARENESSES, GAZES
from shift_schemas.errors import InvalidSettings
from shift_study.study import Study

from shift_simulator.batched_sessions import (
    FAILURE,
    FOCUSED,
    SUCCESS,
    action_costs,
    check_simulable,
    reward_table,
)
from shift_simulator.random_streams import Floats, Ints
from shift_simulator.users import ACTIONS, DEVIATION, User, true_capacity

UNKNOWN = AWARENESSES.index("unknown")
SEEN = (UNKNOWN, FAILURE, SUCCESS)
"""The awareness classes that occur, in the order of the counts."""
MOST_STATES = 2_000_000
"""Largest number of states of capacity, action, gaze and awareness; chosen: at most four minutes and 200 MB."""

Counts = tuple[int, int, int]


@dataclass(frozen=True)
class CapacityGraph:
    """The reachable pairs of estimated and true capacity with the previous action; node 0 is the start."""

    after: NDArray[np.int64]
    """The node after each action, int [nodes, actions]."""
    shown_high: Ints
    true_high: Ints


def optimum(user: User, study: Study, episodes: int) -> float:
    """Return the largest expected cumulative reward of any policy with this user after ``episodes``.

    Raises :class:`InvalidSettings` if there are too many states to enumerate.
    """
    check_simulable(study)
    graph = _capacity_graph(user, study)
    counts = _counts(user.tasks)
    if len(graph.after) * len(GAZES) * len(counts) > MOST_STATES:
        raise InvalidSettings(f"user {user.user} has too many states for the exact optimum; leave out --regret")
    scale = float(reward_table(study.reward)[1].mean())
    value = np.zeros((len(graph.after), len(GAZES), len(counts)))
    for n in range(episodes, 0, -1):
        value = _back_up(value, user, n, graph, counts, scale)
    return float(value[0, FOCUSED, counts.index((user.tasks, 0, 0))])


def _back_up(value: Floats, user: User, n: int, graph: CapacityGraph, counts: list[Counts], scale: float) -> Floats:
    """Return the value before interaction ``n`` from the value after it, both [nodes, gaze, counts].

    It is the expectation over the task that is drawn: each awareness class has the share of its count.
    """
    following = user.gaze.keep * value + (1 - user.gaze.keep) * value.mean(axis=1, keepdims=True)
    chance = DEVIATION / 2 + (1 - DEVIATION) * user.table_at(n).reshape(2, len(GAZES), len(AWARENESSES), ACTIONS)
    before = np.zeros_like(value)
    for i, awareness in enumerate(SEEN):
        p = chance[graph.true_high][:, :, awareness, :]  # [nodes, gaze, actions]
        drawn, succeeded, failed = _moves(counts, i)
        best = np.full((len(value), len(GAZES), len(drawn)), -np.inf)
        for action in range(ACTIONS):
            then = following[graph.after[:, action]]
            chosen = p[:, :, action, None]
            gain = chosen * (scale + then[:, :, succeeded]) + (1 - chosen) * (then[:, :, failed] - scale)
            best = np.maximum(best, gain)
        share = np.array([counts[k][i] for k in drawn]) / sum(counts[0])
        before[:, :, drawn] += share * best
    return before


def _moves(counts: list[Counts], i: int) -> tuple[Ints, Ints, Ints]:
    """Return the counts from which a task of class ``i`` can be drawn, and the counts after success and failure."""
    drawn = [k for k, c in enumerate(counts) if c[i]]
    moved = []
    for to in (2, 1):
        after = []
        for k in drawn:
            c = list(counts[k])
            c[i] -= 1
            c[to] += 1
            after.append(counts.index((c[0], c[1], c[2])))
        moved.append(np.array(after))
    return np.array(drawn), moved[0], moved[1]


def _counts(tasks: int) -> list[Counts]:
    """Return every possible number of tasks that are unknown, failed and done."""
    return [(u, f, tasks - u - f) for u, f in product(range(tasks + 1), repeat=2) if u + f <= tasks]


def _capacity_graph(user: User, study: Study) -> CapacityGraph:
    """Follow all actions from the start until no new node appears; values equal to 9 decimals are one node."""
    both = (study.capacity, true_capacity(user, study))
    cost = [action_costs(settings, study) for settings in both]
    found: dict[tuple[float, float, int], int] = {(both[0].start, both[1].start, -1): 0}
    queue, after = list(found), []
    for shown, true, previous in queue:
        row = []
        for action in range(ACTIONS):
            values = [
                s.after(v, action == previous, float(c[action]))
                for v, s, c in zip((shown, true), both, cost, strict=True)
            ]
            key = (round(values[0], 9), round(values[1], 9), action)
            if key not in found:
                found[key] = len(found)
                queue.append(key)
            row.append(found[key])
        after.append(row)
        if len(found) > MOST_STATES // len(GAZES):
            raise InvalidSettings(f"user {user.user} has too many capacities for the exact optimum; leave out --regret")
    high = [np.array([int(is_high(k[i], s.threshold)) for k in queue]) for i, s in enumerate(both)]
    return CapacityGraph(np.array(after), high[0], high[1])
