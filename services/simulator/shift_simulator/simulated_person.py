"""One simulated person, an event at a time.

Pure: every answer follows from the user, the seed and the number of the interaction. What the person was told
so far is in :attr:`SimulatedPerson.capacity`; :meth:`SimulatedPerson.executed` gives the person after one more
strategy. A driver asks, for n = 1, 2, ...: ``next_task(n)``, ``wanted_gaze(n)``, then, once the decision is there,
``perform(n, ...)``, and goes on with ``executed(action)``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

from shift_model.random_numbers import uniform
from shift_model.vocabulary import GAZES, GazeClass, Triple
from shift_schemas.errors import InvalidSettings
from shift_study.study import CapacitySettings, Study

from shift_simulator.batched_sessions import MARGIN, costs
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
    """How a task went; both dimensions succeed or fail together."""

    success: bool
    comprehension_s: float
    enabledness_s: float


@dataclass(frozen=True)
class SimulatedPerson:
    """A user of one study in one session. Start with :func:`person`."""

    user: User
    study: Study
    seed: int
    """The session's seed: the decider draws from the same one, at stream 0."""
    capacity: float
    """Its true processing capacity."""
    previous: int | None = None
    """The action it was told with last."""

    def next_task(self, n: int) -> int:
        """Which of its tasks interaction ``n`` is about, from 0: uniform with replacement."""
        return int(uniform(self.seed, n, TASK) * self.user.tasks)

    def wanted_gaze(self, n: int) -> GazeClass:
        """The gaze class during interaction ``n``: focused at first, then kept or drawn anew."""
        while n > 1 and uniform(self.seed, n, GAZE_KEPT) < self.user.gaze.keep:
            n -= 1
        return "focused" if n <= 1 else GAZES[int(uniform(self.seed, n, GAZE_CLASS) * len(GAZES))]

    def perform(self, n: int, triple: Triple, action: int) -> Outcome:
        """The outcome of the action (its index) at the triple that the decision shows.

        Looked up with the person's true capacity class, then a fair coin with probability 0.05.
        """
        lasts = [DURATIONS[int(uniform(self.seed, n, s) * len(DURATIONS))] for s in (T_COMPREHENSION, T_ENABLEDNESS)]
        return Outcome(self._succeeds(n, triple, action), float(lasts[0]), float(lasts[1]))

    def executed(self, action: int) -> SimulatedPerson:
        """The person after being told with this action: its capacity recovers by repetition, else it pays."""
        s = self._settings
        if action == self.previous:
            capacity = min(self.capacity + s.recovery, s.max)
        else:
            capacity = max(self.capacity - float(costs(s, self.study)[action]), s.min)
        return replace(self, capacity=capacity, previous=action)

    @cached_property
    def _settings(self) -> CapacitySettings:
        return true_capacity(self.user, self.study)

    def _succeeds(self, n: int, triple: Triple, action: int) -> bool:
        if uniform(self.seed, n, DEVIATES) < DEVIATION:
            return uniform(self.seed, n, COIN) < 0.5
        true = triple
        if self._settings != self.study.capacity:
            true = triple._replace(capacity="high" if self.capacity >= self._settings.threshold - MARGIN else "low")
        return uniform(self.seed, n, SUCCESS) < float(self.user.table_at(n)[true.number, action])


def person(user: User, study: Study, seed: int) -> SimulatedPerson:
    """A person at the start of a session with this seed."""
    return SimulatedPerson(user, study, seed, true_capacity(user, study).start)


def task_names(user: User, study: Study) -> list[str]:
    """What the person's tasks are called: the study's first ones, or task-1, task-2, ... where any id is a task.

    Raises :class:`InvalidSettings` where the study has fewer tasks than the person.
    """
    if study.tasks is None:
        return [f"task-{i + 1}" for i in range(user.tasks)]
    if len(study.tasks) < user.tasks:
        raise InvalidSettings(f"user {user.user} has {user.tasks} tasks; study {study.study} has {len(study.tasks)}")
    return list(study.tasks[: user.tasks])
