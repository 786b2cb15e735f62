"""One simulated session, one event at a time, through the cores that the services run.

Pure: there is no bus and no clock. The persons and random numbers are those of ``batched_sessions`` and ``live``.
With a discount of 0, all three agree step by step for the same session seed.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

from shift_decider import core as decider
from shift_learner import core as learner
from shift_model.vocabulary import Triple
from shift_monitor import core as monitor
from shift_schemas.lifecycle import LIVE
from shift_schemas.messages import (
    FORMAT,
    Config,
    Decide,
    Decision,
    Fact,
    GazeChunk,
    Observation,
    Performance,
    ReportPerformance,
    Result,
    Session,
)
from shift_schemas.timestamps import Stamp
from shift_study.loading import study_json
from shift_study.study import Study

from shift_simulator.gaze_plan import chunk_of, plan_gaze
from shift_simulator.simulated_person import SimulatedPerson, create_person, task_names
from shift_simulator.users import User

SESSION = "simulated"
SOURCE = "simulator"


class Episode(NamedTuple):
    """One interaction: the observation at the decision, the decision, and the performance."""

    observation: Observation
    decision: Decision
    action: int
    performance: Performance


def play(user: User, study: Study, seed: int, episodes: int) -> Iterator[Episode]:
    """Yield the ``episodes`` interactions of a session with the session seed ``seed``."""
    mesh = Mesh(study, seed)
    person = create_person(user, study, seed)
    tasks = task_names(user, study)
    for n in range(1, episodes + 1):
        mesh.look(person, n)
        observation = mesh.observation
        decision = mesh.decide(tasks[person.next_task(n)], n)
        action = decision.actions.index(decision.strategy)
        performance = mesh.report(person, decision, action)
        person = person.after(action)
        yield Episode(observation, decision, action, performance)


@dataclass
class Mesh:
    """The three cores of monitor, decider and learner; each fact reaches its readers at once."""

    study: Study
    seed: int

    def __post_init__(self) -> None:
        self._now = Stamp.of(0)
        self._monitor: monitor.MonitorState | None = None
        self._decider: decider.DeciderState | None = None
        self._learner: learner.LearnerState | None = None
        self._clock_ns = 0
        self._chunks = 0
        start = Session(
            session=SESSION, stamp=self._now, participant="P00", study=self.study.study, seed=self.seed,
            state=LIVE, started=self._now, format=FORMAT,
        )  # fmt: skip
        self._apply(start)
        self._apply(Config(session=SESSION, stamp=self._now, version=1, study=study_json(self.study)))

    def look(self, person: SimulatedPerson, n: int) -> None:
        """Apply the gaze that produces the person's gaze class in interaction ``n``."""
        looks = plan_gaze(self.study, self.observation.gaze, person.wanted_gaze(n))
        if looks:
            chunk, self._clock_ns = chunk_of(self.study, looks, SOURCE, self._chunks, self._clock_ns)
            self._chunks += 1
            self._apply(chunk)
            self._apply(monitor.Show())

    def decide(self, task: str, n: int) -> Decision:
        """Return the decision for a task in interaction ``n``."""
        done = decider.step(self._decider, Decide(command_id=f"d{n}", session=SESSION, task=task), self._now)
        self._decider = done.state
        for fact in done.facts:
            self._apply(fact)
        decision = done.facts[-1]
        assert isinstance(decision, Decision)
        return decision

    def report(self, person: SimulatedPerson, decision: Decision, action: int) -> Performance:
        """Let the person perform the task, and return the performance that the learner publishes."""
        seen = decision.observation
        outcome = person.perform(decision.n, Triple(seen.capacity, seen.gaze, seen.awareness), action)
        command = ReportPerformance(
            command_id=decision.decision_id, session=SESSION,
            comprehension=Result(success=outcome.success, duration_s=outcome.comprehension_s),
            enabledness=Result(success=outcome.success, duration_s=outcome.enabledness_s),
        )  # fmt: skip
        done = learner.step(self._learner, command, self._now)
        self._learner = done.state
        for fact in done.facts:
            self._apply(fact)
        return next(fact for fact in done.facts if isinstance(fact, Performance))

    def _apply(self, event: Fact | GazeChunk | monitor.Show) -> None:
        """Apply a fact or a chunk of gaze to the cores, and the facts that result from it to the decider."""
        observed = monitor.step(self._monitor, event, self._now)
        self._monitor = observed.state
        facts = list(observed.facts)
        if isinstance(event, Fact):
            learned = learner.step(self._learner, event, self._now)
            self._learner = learned.state
            facts += learned.facts
            self._decider = decider.step(self._decider, event, self._now).state
        for fact in facts:
            if isinstance(fact, Observation):
                self.observation = fact
            self._decider = decider.step(self._decider, fact, self._now).state
