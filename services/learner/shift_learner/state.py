"""The state of the learner for one session, and its JSON form. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

from pydantic import TypeAdapter
from shift_schemas.errors import Unavailable
from shift_schemas.lifecycle import LIVE
from shift_schemas.messages import Config, Performance, Seen, SessionState, Versions
from shift_study.loading import study_from_json

from shift_learner.learner import Context, DecisionView, Learner
from shift_learner.learners import learner_named


@dataclass(frozen=True)
class OpenDecision:
    """A decision without a report, or one that was reported and not learned from yet."""

    task: str
    taken: DecisionView
    versions: Versions
    following: DecisionView | None = None
    """The decision after it, once there is one."""


@dataclass(frozen=True)
class Reported:
    """A reported decision, as far as a correction needs it."""

    open: OpenDecision
    performance: Performance
    """The report in force."""


@dataclass(frozen=True)
class LearnerState:
    """The state of one session. ``memory`` is of the learner's own type; its JSON form is plain."""

    session: str
    phase: SessionState = LIVE
    config: Config | None = None
    memory: Any = None
    open: dict[str, OpenDecision] = field(default_factory=dict)
    rewards: dict[str, float] = field(default_factory=dict)
    """The rewards that were reported and wait for the next decision."""
    reported: dict[str, Reported] = field(default_factory=dict)
    results: dict[str, int] = field(default_factory=dict)
    """The number of reports of each task, without corrections."""
    format: int = 1
    """The format of the session's recording (``shift_schemas.messages.FORMAT``)."""
    last: DecisionView | None = None
    decisions: int = 0
    performances: int = 0
    cumulative_reward: float = 0.0
    version: int = 0

    @property
    def context(self) -> Context:
        """The context of the study in force. Raises :class:`Unavailable` before the first configuration."""
        if self.config is None:
            raise Unavailable("the recorder has not published a configuration of this session yet; ask again")
        return context_of(self.config.study)

    @property
    def learner(self) -> Learner:
        """The learner that the study in force names."""
        return learner_named(self.context.study.learner.name)

    @property
    def seen(self) -> Seen:
        """The inputs that were applied."""
        version = self.config.version if self.config else 0
        return Seen(decision=self.decisions, performance=self.performances, config=version)


_STATE = TypeAdapter(LearnerState)
_REPORTED = TypeAdapter(Reported)


def dump(state: LearnerState) -> str:
    """Return the state as JSON; :func:`load` returns an equal state."""
    plain = state if state.config is None else replace(state, memory=state.learner.dump(state.memory))
    return _STATE.dump_json(plain).decode()


def load(text: str) -> LearnerState:
    """Return the state that :func:`dump` wrote."""
    state = _STATE.validate_json(text)
    if state.config is None:
        return state
    return replace(state, memory=state.learner.load(state.context, state.memory))


# --- the parts that are kept apart ---


def parts_of(state: LearnerState) -> dict[str, Reported]:
    """Return the reported decisions by their ids: a commit changes one of them at most."""
    return state.reported


def without_parts(state: LearnerState) -> LearnerState:
    """Return the state without the reported decisions."""
    return replace(state, reported={})


def dump_part(part: Reported) -> str:
    """Return a reported decision as JSON."""
    return _REPORTED.dump_json(part).decode()


def restore_parts(state: LearnerState, parts: Mapping[str, str]) -> LearnerState:
    """Return the state with the reported decisions, in the order of their reports."""
    reported = {name: _REPORTED.validate_json(text) for name, text in parts.items()}
    return replace(state, reported=dict(sorted(reported.items(), key=lambda item: item[1].performance.n)))


@lru_cache(maxsize=64)
def context_of(study: str) -> Context:
    """Return the context of a study in force, given as ``config`` facts carry it."""
    return Context(study_from_json(study))
