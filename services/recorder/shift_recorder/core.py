"""The recorder's core: ``step(state, command, now) -> Step``. Pure.

It owns the session: start, end, configure and mark. The shell finds studies by their names and finishes recordings; the
core receives the results.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

from pydantic import TypeAdapter
from shift_schemas.core_protocol import Step
from shift_schemas.errors import Conflict, FieldError, MalformedMessage, UnknownThing
from shift_schemas.lifecycle import ENDED, LIVE, check_accepts, next_state
from shift_schemas.messages import (
    MOST_WARNINGS,
    Command,
    Config,
    Configure,
    EndSession,
    Fact,
    Mark,
    Marker,
    Session,
    SessionEvent,
    StartSession,
)
from shift_schemas.shared_text import shared
from shift_schemas.timestamps import Stamp
from shift_study.loading import patched, study_data, study_from_json, study_in_force, study_json, study_of
from shift_study.study import Study, fixed_changes


class FinishSession(EndSession):
    """The second half of an end, once the recording is finished. Its content is that of the first half."""

    procedure: ClassVar[str] = "end_session"
    event: ClassVar[SessionEvent] = "finish"

    recording: str
    sha256: str
    counts: dict[str, int]

    def content(self) -> str:
        """Return the content of the end."""
        return EndSession(command_id=self.command_id, session=self.session).content()


@dataclass(frozen=True)
class RecorderState:
    """The recorder's state of one session."""

    fact: Session
    config: Config
    original: str
    """The study as JSON, as it was given, without the condition's changes; it is attached to the recording."""
    markers: dict[str, bool] = field(default_factory=dict)
    """Each marker's id, and whether a later marker retracted it."""


_STATE = TypeAdapter(RecorderState)


def dump(state: RecorderState) -> str:
    """Return the state as JSON, from which :func:`load` restores it exactly."""
    return _STATE.dump_json(state).decode()


def load(text: str) -> RecorderState:
    """Return the state that :func:`dump` wrote."""
    return _STATE.validate_json(text)


def seed_of(session: str) -> int:
    """Return the seed of a session without one: it is made from the id, so that it is the same after a restart."""
    return int.from_bytes(hashlib.sha256(session.encode()).digest()[:6], "big")


def session_answer(fact: Session) -> dict[str, Any]:
    """Return a session as the gateway shows it."""
    data: dict[str, Any] = fact.model_dump(mode="json", exclude={"stamp", "seen", "subject"})
    return data


def step(
    state: RecorderState | None, message: Fact | Command, now: Stamp, timed_out: bool = False
) -> Step[RecorderState]:
    """Return the result of one command.

    Raises
    ------
    UnknownThing, Conflict, MalformedMessage
        The command cannot be carried out.
    """
    if isinstance(message, StartSession):
        return _start(state, message, now)
    if state is None:
        raise UnknownThing(f"there is no session {message.session}")
    match message:
        case FinishSession():
            return _finish(state, message)
        case EndSession():
            return _end(state, message, now)
        case Configure():
            return _configure(state, message, now)
        case Mark():
            return _mark(state, message, now)
    return Step(state)


def _start(state: RecorderState | None, command: StartSession, now: Stamp) -> Step[RecorderState]:
    if state is not None:
        raise Conflict(f"session {command.session} is there already, with another content")
    study = study_of(command.study)
    _check_condition(study, command.condition)
    in_force = study_in_force(study, command.condition)
    fact = Session(
        session=command.session, stamp=now, participant=command.participant, study=study.study,
        condition=command.condition, seed=seed_of(command.session) if command.seed is None else command.seed,
        state=LIVE, started=now, replay_of=command.replay_of,
        software=command.software, revision=command.revision, shard=command.shard, format=command.format,
        warnings=_start_warnings(study, command), covariates=command.covariates,
    )  # fmt: skip
    config = Config(session=command.session, stamp=now, version=1, study=study_json(in_force))
    original = shared(json.dumps(study_data(study), ensure_ascii=False))
    return Step(RecorderState(fact, config, original), (fact, config), session_answer(fact))


def _check_condition(study: Study, condition: str | None) -> None:
    if condition is None and study.require_condition:
        rule = f"study {study.study} requires a condition; give one of: {', '.join(study.conditions)}"
        raise MalformedMessage(f"condition: {rule}", (FieldError(field="condition", value="", rule=rule),))


def _start_warnings(study: Study, command: StartSession) -> list[str]:
    """Return warnings about what is valid but perhaps not intended; a session of format 1 records none."""
    if command.format == 1:
        return []
    if command.condition is not None or not study.conditions:
        return command.warnings[:MOST_WARNINGS]
    known = ", ".join(study.conditions)
    warning = (
        f"study {study.study} has the conditions {known} and none was chosen, so this participant is in none of them; "
        "give one as condition, or write require_condition: true into the study"
    )
    return [warning, *command.warnings][:MOST_WARNINGS]


def _end(state: RecorderState, command: EndSession, now: Stamp) -> Step[RecorderState]:
    after = next_state(state.fact.state, command)
    if after == state.fact.state:
        return Step(state)
    fact = state.fact.model_copy(update={"stamp": now, "state": after})
    return Step(replace(state, fact=fact), (fact,))


def ended(state: RecorderState) -> Session:
    """Return the ended session as its recording has it, which cannot contain its own checksum.

    Its end time is that of the first half, which is committed, so that every attempt to finish gives the same time.
    """
    name = f"{state.fact.session}.mcap"
    return state.fact.model_copy(update={"state": ENDED, "ended": state.fact.stamp, "recording": name})


def _finish(state: RecorderState, command: FinishSession) -> Step[RecorderState]:
    update = {"sha256": command.sha256, "counts": command.counts, "recording": command.recording}
    fact = ended(state).model_copy(update=update)
    result = {
        "session": fact.session, "state": fact.state, "recording": fact.recording,
        "sha256": fact.sha256, "counts": fact.counts,
    }  # fmt: skip
    return Step(replace(state, fact=fact), (fact,), result)


def _configure(state: RecorderState, command: Configure, now: Stamp) -> Step[RecorderState]:
    check_accepts(command.session, state.fact.state, command)
    before = study_from_json(state.config.study)
    after = patched(before, command.patch)
    check_changeable(before, after)
    config = Config(
        session=command.session, stamp=now, version=state.config.version + 1,
        study=study_json(after), author=command.author,
    )  # fmt: skip
    return Step(replace(state, config=config), (config,), config_answer(config))


def config_answer(config: Config) -> dict[str, Any]:
    """Return the study in force with its version, as the gateway shows it."""
    return {**json.loads(config.study), "version": config.version}


def check_changeable(before: Study, after: Study) -> None:
    """Raise :class:`MalformedMessage` with the names of settings that must not change while a session runs."""
    if names := fixed_changes(before, after):
        rule = "it cannot change while a session runs; end the session and start another one"
        raise MalformedMessage(
            f"{', '.join(names)} cannot change while a session runs",
            tuple(FieldError(field=name, value="", rule=rule) for name in names),
        )


def _mark(state: RecorderState, command: Mark, now: Stamp) -> Step[RecorderState]:
    check_accepts(command.session, state.fact.state, command)
    markers = {**state.markers, command.command_id: False}
    if command.retracts is not None:
        _check_retractable(state, command.retracts)
        markers[command.retracts] = True
    fact = Marker(
        session=command.session, stamp=now, marker_id=command.command_id, text=command.text,
        retracts=command.retracts or "", author=command.author,
    )  # fmt: skip
    return Step(replace(state, markers=markers), (fact,), fact)


def _check_retractable(state: RecorderState, marker: str) -> None:
    """Raise an error unless the session has this marker and no marker retracted it."""
    if marker not in state.markers:
        raise UnknownThing(f"session {state.fact.session} has no marker {marker} that could be retracted")
    if state.markers[marker]:
        raise Conflict(f"marker {marker} is retracted already")
