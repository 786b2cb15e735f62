"""A simulated person at the live mesh, through the gateway, as the paper did on its real system.

The gaze class of each interaction is brought about with chunks of gaze on a clock of their own, faster
than real time. With the same session seed the decisions are those of :mod:`shift_simulator.session`.
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
from shift_simulator.simulated_person import SimulatedPerson, person, task_names
from shift_simulator.users import User


class LiveEpisode(NamedTuple):
    """One interaction: the decision and the performance as the gateway answered them."""

    decision: dict[str, Any]
    performance: dict[str, Any]


def study_at(shift: RestClient, session: str) -> Study:
    """The study in force."""
    config = shift.config(session)
    return study_of(as_recorded({k: v for k, v in config.items() if k != "version"}))


def drive(shift: RestClient, session: str, user: User, episodes: int) -> Iterator[LiveEpisode]:
    """Go on with a session for ``episodes`` interactions; it may have had some before.

    Raises
    ------
    ShiftError
        What the gateway refused, or that it did not answer.
    """
    study = study_at(shift, session)
    known = shift.session(session)
    someone = person(user, study, known["seed"])
    tasks = task_names(user, study)
    looker = _Looker(shift, session, study)
    first = known.get("counts", {}).get("decision", 0) + 1
    for n in range(first, first + episodes):
        looker.look(someone, n)
        decision = shift.decide(session, tasks[someone.next_task(n)], f"{looker.source}-d{n}")
        action = decision["actions"].index(decision["strategy"])
        outcome = someone.perform(n, Triple(**decision["observation"]), action)
        performance = shift.report(
            session, decision["decision_id"],
            outcome.success, outcome.comprehension_s, outcome.success, outcome.enabledness_s,
        )  # fmt: skip
        someone = someone.after(action)
        yield LiveEpisode(decision, performance)


class _Looker:
    """The person's eyes: a gaze source of its own, with a clock of its own."""

    def __init__(self, shift: RestClient, session: str, study: Study) -> None:
        self.shift = shift
        self.session = session
        self.study = study
        self.source = f"simulator-{secrets.token_hex(4)}"
        self._clock_ns = 0
        self._chunks = 0

    def look(self, someone: SimulatedPerson, n: int) -> None:
        """Bring the gaze class of interaction ``n`` about."""
        seen = self.shift.observation(self.session)["gaze"]
        view = GazeView.model_validate({**seen, "aoi": seen["aoi"] or ""})
        looks = plan_gaze(self.study, view, someone.wanted_gaze(n))
        if looks:
            chunk, self._clock_ns = chunk_of(self.study, looks, self.source, self._chunks, self._clock_ns)
            self._chunks += 1
            self.shift.gaze(self.session, chunk)
