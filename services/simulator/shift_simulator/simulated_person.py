"""One simulated person, one event at a time.

Pure: every result depends only on the user, the seed and the number of the interaction. For n = 1, 2, ..., a driver
calls ``next_task(n)`` and ``wanted_gaze(n)``, and after the decision ``perform(n, ...)``. It continues with the
person that ``after(action)`` returns.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

from shift_model.capacity import capacity_class
from shift_model.random_numbers import uniform
from shift_model.vocabulary import GAZES, GazeClass, Triple
from shift_schemas.errors import InvalidSettings
from shift_study.constants import CapacitySettings
from shift_study.study import Study

from shift_simulator.random_streams import (
    COIN,
    DEVIATES,
    GAZE_CLASS,
    GAZE_KEPT,
    SUCCESS,
    T_COMPREHENSION,
    T_ENABLEDNESS,
    TASK,
)
from shift_simulator.users import DEVIATION, DURATIONS, User, true_capacity


class Outcome(NamedTuple):
    """The outcome of a task; both dimensions succeed or fail together."""

    success: bool
    comprehension_s: float
    enabledness_s: float


@dataclass(frozen=True)
class SimulatedPerson:
    """A simulated user in one session of a study, made by :func:`create_person`."""

    user: User
    study: Study
    seed: int
    """The session's seed; the decider uses the same one, with stream 0."""
    capacity: float
    """The true processing capacity."""
    previous: int | None = None
    """The action of the last explanation, an index."""

    def next_task(self, n: int) -> int:
        """Return the task (from 0) of interaction ``n``: uniform with replacement."""
        return int(uniform(self.seed, n, TASK) * self.user.tasks)

    def wanted_gaze(self, n: int) -> GazeClass:
        """Return the gaze class during interaction ``n``: focused at first, then kept or drawn again."""
        while n > 1 and uniform(self.seed, n, GAZE_KEPT) < self.user.gaze.keep:
            n -= 1
        return "focused" if n <= 1 else GAZES[int(uniform(self.seed, n, GAZE_CLASS) * len(GAZES))]

    def perform(self, n: int, triple: Triple, action: int) -> Outcome:
        """Return the outcome of the action (an index) at the triple that the decision shows.

        The table is read at the person's true capacity class. With probability 0.05, a fair coin decides instead.
        """
        times_s = [DURATIONS[int(uniform(self.seed, n, s) * len(DURATIONS))] for s in (T_COMPREHENSION, T_ENABLEDNESS)]
        return Outcome(self._succeeds(n, triple, action), float(times_s[0]), float(times_s[1]))

    def after(self, action: int) -> SimulatedPerson:
        """Return the person after an explanation with this action, by the capacity equation."""
        cost = self._settings.cost_of(self.study.scoring.actions[action])
        capacity = self._settings.after(self.capacity, action == self.previous, cost)
        return replace(self, capacity=capacity, previous=action)

    @cached_property
    def _settings(self) -> CapacitySettings:
        return true_capacity(self.user, self.study)

    def _succeeds(self, n: int, triple: Triple, action: int) -> bool:
        if uniform(self.seed, n, DEVIATES) < DEVIATION:
            return uniform(self.seed, n, COIN) < 0.5
        true = triple
        if self._settings != self.study.capacity:
            true = triple._replace(capacity=capacity_class(self.capacity, self._settings.threshold))
        return uniform(self.seed, n, SUCCESS) < float(self.user.table_at(n)[true.number, action])


def create_person(user: User, study: Study, seed: int) -> SimulatedPerson:
    """Return the person at the start of a session with this seed."""
    return SimulatedPerson(user, study, seed, true_capacity(user, study).start)


def task_names(user: User, study: Study) -> list[str]:
    """Return the names of the person's tasks: the study's first ones, or task-1, task-2, ... if any id is a task.

    Raises :class:`InvalidSettings` if the study has fewer tasks than the person.
    """
    if study.tasks is None:
        return [f"task-{i + 1}" for i in range(user.tasks)]
    if len(study.tasks) < user.tasks:
        raise InvalidSettings(f"user {user.user} has {user.tasks} tasks; study {study.study} has {len(study.tasks)}")
    return list(study.tasks[: user.tasks])
