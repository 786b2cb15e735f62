"""Decide a recording again with one thing different: another study, another learner, or other gaze. Pure.

The inputs are those that were recorded, in the order in which the services read them: gaze, reports, configurations,
and the strategies that were used. The cores of the monitor, the learner and the decider are stepped once more with the
difference. So each decision of the other policy is made in the situation that was recorded, with the recorded history;
the person's answer to another strategy is not known and is not invented.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from shift_decider.core import DeciderState, decide
from shift_learner import core as learner
from shift_model.random_numbers import pick, uniform
from shift_monitor import core as monitor
from shift_monitor.gaze_input import ChunkWithHistory
from shift_schemas.core_protocol import Step
from shift_schemas.errors import ShiftError
from shift_schemas.messages import (
    Config,
    Decision,
    GazeChunk,
    Observation,
    Performance,
    Policy,
    ReportPerformance,
    Seen,
    Session,
    Strategy,
)
from shift_schemas.timestamps import Stamp
from shift_verify.verify import Observers


def _same(given: Any) -> Any:
    return given


@dataclass(frozen=True)
class Alternative:
    """What is different when a recording is decided again."""

    study_of: Callable[[str], str] = _same
    """Returns the study, as a configuration's JSON string, that stands in place of a recorded one."""
    gaze_of: Callable[[GazeChunk], GazeChunk | None] = _same
    """Returns the chunk that stands in place of a recorded one; None leaves it out."""


@dataclass(frozen=True)
class DecidedAgain:
    """One decision as it was recorded, and as it would have been made otherwise."""

    logged: Decision
    other: Decision
    reward: float | None
    """The reward that was recorded for the decision, after corrections; None without a report."""

    @property
    def own(self) -> Strategy:
        """The strategy that SHIFT chose, also where a person's override took its place."""
        if self.logged.policy_source != "override":
            return self.logged.strategy
        return self.logged.actions[pick(self.logged.probabilities, uniform(self.logged.seed, self.logged.n))]


@dataclass
class _LearnerInput:
    event: object
    now: Stamp
    policy: int
    """The version of the recorded policy that followed; 0 if none did."""


@dataclass
class Redecider:
    """The recorded inputs of one session, from which each alternative is decided again.

    Hand :attr:`observers` to ``verify``, then call :meth:`decisions` for each alternative.
    """

    alternatives: Sequence[Alternative]
    rewards: dict[str, float] = field(default_factory=dict)
    """The recorded reward of each decision, by its id; of a corrected report the last one."""
    session: Session | None = None
    changes: int = 0
    """How often the study was changed while the session ran."""
    has_points: bool = False
    """Whether there is gaze as points on the stimulus."""
    _learner_inputs: list[_LearnerInput] = field(default_factory=list)
    _needed: set[int] = field(default_factory=set)
    _states: list[monitor.MonitorState | None] = field(default_factory=list)
    _observations: list[dict[int, Observation]] = field(default_factory=list)
    _refused: dict[int, ShiftError] = field(default_factory=dict)
    """By the number of an alternative: why its monitor cannot take the recorded inputs."""

    def __post_init__(self) -> None:
        self._states = [None for _ in self.alternatives]
        self._observations = [{} for _ in self.alternatives]

    @property
    def observers(self) -> Observers:
        """The functions that collect what is decided again."""
        return Observers(self._on_learner, self._on_monitor)

    def _on_learner(self, event: object, now: Stamp, step: Step[Any]) -> None:
        """Keep an input of the learner, which is derived before the monitor."""
        last = step.facts[-1] if step.facts else None
        self._learner_inputs.append(_LearnerInput(event, now, last.version if isinstance(last, Policy) else 0))
        self.rewards |= {fact.decision_id: fact.reward for fact in step.facts if isinstance(fact, Performance)}
        if isinstance(event, Decision):
            self._needed.add(event.versions.observation)
        elif isinstance(event, Config):
            self.changes += event.version > 1
        elif isinstance(event, Session) and self.session is None:
            self.session = event

    def _on_monitor(self, event: object, now: Stamp, step: Step[Any]) -> None:
        """Step the monitor of each alternative, and keep the observations that decisions were made with."""
        if isinstance(event, ChunkWithHistory) and event.chunk.x is not None:
            self.has_points = True
        shown = step.facts[-1] if step.facts else None
        version = shown.version if isinstance(shown, Observation) and shown.version in self._needed else 0
        for i, alternative in enumerate(self.alternatives):
            if i in self._refused:
                continue
            try:
                self._states[i] = state = _monitor_after(self._states[i], alternative, event, now)
            except ShiftError as e:
                self._refused[i] = e
                continue
            if version:
                self._observations[i][version] = monitor.observation_of(state, now)

    def decisions(self, number: int) -> list[DecidedAgain]:
        """Return the session's decisions under the alternative of this number.

        Only those are there whose observation is in the recording. Raise a :class:`ShiftError` if the alternative
        cannot take the recorded inputs, such as gaze on an AOI that its study does not have.
        """
        if number in self._refused:
            raise self._refused[number]
        assert self.session is not None
        shadow = OtherDecider(self.session, self.alternatives[number], self._observations[number])
        for given in self._learner_inputs:
            shadow.take(given.event, given.now, given.policy)
        return [replace(each, reward=self.rewards.get(each.logged.decision_id)) for each in shadow.decisions]


def _monitor_after(
    state: monitor.MonitorState | None, alternative: Alternative, event: object, now: Stamp
) -> monitor.MonitorState:
    match event:
        case Config():
            event = with_study(event, alternative)
        case ChunkWithHistory():
            chunk = alternative.gaze_of(event.chunk)
            if chunk is None:
                assert state is not None
                return state
            event = event._replace(chunk=chunk)
        case monitor.Show():  # what is held back is in the state as well
            assert state is not None
            return state
    return monitor.step(state, event, now, timed_out=True).state


def with_study(config: Config, alternative: Alternative) -> Config:
    """Return a recorded configuration with the alternative's study."""
    return config.model_copy(update={"study": alternative.study_of(config.study)})


class OtherDecider:
    """The learner and the decider of one alternative, stepped with the recorded decisions and reports.

    Parameters
    ----------
    session
        The session as it began.
    alternative
        Gives the study.
    observations
        The observations of the alternative's monitor, by the version of the recorded observation in whose place they
        stand. A decision without one is left out.
    """

    def __init__(self, session: Session, alternative: Alternative, observations: Mapping[int, Observation]) -> None:
        self.session = session
        self.alternative = alternative
        self.observations = observations
        self.decisions: list[DecidedAgain] = []
        """The decisions so far, without rewards."""
        self._state: learner.LearnerState | None = None
        self._configs: dict[int, Config] = {}
        self._policies: dict[int, Policy] = {}

    def take(self, event: object, now: Stamp, policy: int) -> None:
        """Step the learner with a recorded input. A decision is decided again before.

        ``policy`` is the version of the recorded policy that followed the input; 0 if none did.
        """
        if isinstance(event, Config):
            event = self._configs[event.version] = with_study(event, self.alternative)
        elif isinstance(event, Decision):
            if event.versions.observation not in self.observations:
                return
            other = self._decide(event)
            self.decisions.append(DecidedAgain(event, other, None))
            event = _as_learned_from(event, other)
        elif isinstance(event, ReportPerformance) and not self._knows(event.decision_id):
            return
        step = learner.step(self._state, event, now, timed_out=True)  # type: ignore[arg-type]
        self._state = step.state
        if policy and step.facts and isinstance(published := step.facts[-1], Policy):
            self._policies[policy] = published

    def _knows(self, decision_id: str) -> bool:
        return any(each.logged.decision_id == decision_id for each in self.decisions)

    def _decide(self, logged: Decision) -> Decision:
        """Return the decision that would have been made in place of a recorded one. An override has no effect on it."""
        state = DeciderState(
            session=logged.session, seed=self.session.seed, config=self._configs[logged.versions.config],
            observation=self.observations[logged.versions.observation],
            policy=self._policies.get(logged.versions.policy), n=logged.n - 1, format=self.session.format,
        )  # fmt: skip
        return decide(state, logged.task, logged.decision_id, Seen(), logged.stamp, timed_out=True)


def _as_learned_from(logged: Decision, other: Decision) -> Decision:
    """Return the decision that the other learner learns from: its own view of the person, and the used strategy."""
    return other.model_copy(
        update={
            "strategy": logged.strategy, "propensity": logged.propensity, "explored": logged.explored,
            "policy_source": logged.policy_source, "versions": logged.versions,
        }
    )  # fmt: skip
