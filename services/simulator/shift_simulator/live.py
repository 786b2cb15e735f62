"""A simulated person uses the live mesh through the gateway, as in the paper's run on its real system.

Chunks of gaze on their own clock, faster than real time, produce the gaze class of each interaction. With the same
session seed, the decisions equal those of :mod:`shift_simulator.session`.
"""

from __future__ import annotations

import secrets
from collections.abc import Iterator
from typing import Any, NamedTuple

from shift_model.vocabulary import Triple
from shift_runtime.rest_client import RestClient
from shift_schemas.messages import GazeView
from shift_study.loading import as_recorded, study_of
from shift_study.study import Study

from shift_simulator.gaze_plan import chunk_of, plan_gaze
from shift_simulator.simulated_person import Outcome, SimulatedPerson, create_person, task_names
from shift_simulator.users import User


class LiveEpisode(NamedTuple):
    """One interaction: the decision and the performance as the gateway answered them, and what the person did."""

    decision: dict[str, Any]
    performance: dict[str, Any]
    outcome: Outcome


def study_at(shift: RestClient, session: str) -> Study:
    """Return the study that is in force in the session."""
    config = shift.config(session)
    return study_of(as_recorded({k: v for k, v in config.items() if k != "version"}))


def drive(shift: RestClient, session: str, user: User, episodes: int) -> Iterator[LiveEpisode]:
    """Add ``episodes`` interactions to a session, which may have earlier ones; yield each one.

    Raises
    ------
    ShiftError
        The gateway refused a request or did not answer.
    """
    study = study_at(shift, session)
    known = shift.session(session)
    person = create_person(user, study, known["seed"])
    tasks = task_names(user, study)
    source = _GazeSource(shift, session, study)
    first = known.get("counts", {}).get("decision", 0) + 1
    for n in range(first, first + episodes):
        source.look(person, n)
        decision = shift.decide(session, tasks[person.next_task(n)], f"{source.name}-d{n}")
        action = decision["actions"].index(decision["strategy"])
        outcome = person.perform(n, Triple(**decision["observation"]), action)
        performance = shift.report(
            session, decision["decision_id"],
            outcome.success, outcome.comprehension_s, outcome.success, outcome.enabledness_s,
        )  # fmt: skip
        person = person.after(action)
        yield LiveEpisode(decision, performance, outcome)


class _GazeSource:
    """The gaze source of the person, with its own clock."""

    def __init__(self, shift: RestClient, session: str, study: Study) -> None:
        self.shift = shift
        self.session = session
        self.study = study
        self.name = f"simulator-{secrets.token_hex(4)}"
        self._clock_ns = 0
        self._chunks = 0

    def look(self, person: SimulatedPerson, n: int) -> None:
        """Send the gaze that produces the gaze class of interaction ``n``."""
        seen = self.shift.observation(self.session)["gaze"]
        view = GazeView.model_validate({**seen, "aoi": seen["aoi"] or ""})
        looks = plan_gaze(self.study, view, person.wanted_gaze(n))
        if looks:
            chunk, self._clock_ns = chunk_of(self.study, looks, self.name, self._chunks, self._clock_ns)
            self._chunks += 1
            self.shift.gaze(self.session, chunk)
