"""Derive the recorder's facts again: the session, its configurations and markers. Pure.

A start is derived from the attached study, a change of the configuration from the configuration before it.
"""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import replace
from typing import Any

from shift_recorder.core import RecorderState, ended, step
from shift_schemas.errors import ShiftError
from shift_schemas.lifecycle import accepts_input, has_ended
from shift_schemas.messages import (
    END_ID,
    START_ID,
    Config,
    Configure,
    EndSession,
    Fact,
    Mark,
    Marker,
    Session,
    StartSession,
)
from shift_study.loading import as_recorded
from shift_study.patching import merge_patch_between

from shift_verify.difference import Differs, FactAtPlace, compare, differ, is_missing


class RecorderFold:
    """The recorder's facts: session, configurations and markers. Hand each to :meth:`take` in the recorder's order.

    Parameters
    ----------
    study
        The attached study. A segment has none, and its start is then accepted as it is.
    versions
        The versions of the configurations that the recording has.
    claimed
        The largest version that a service says it has seen.
    """

    def __init__(self, study: bytes | None, versions: frozenset[int] = frozenset(), claimed: int = 0) -> None:
        self.study = study
        self.versions = versions
        self.claimed = claimed
        self.checked: Counter[str] = Counter()
        self.sequence = 0
        self.state: RecorderState | None = None
        self.start: Session | None = None
        self._place = 0

    def take(self, placed: FactAtPlace) -> None:
        """Derive and compare the recorder's next fact. Raises :class:`Differs`."""
        fact, self.sequence = placed.fact, placed.sequence
        try:
            if self.start is None:
                self._take_first(placed)
            elif self.state is None:
                self._take_second(self.start, placed)
            else:
                self._take_later(self.state, placed)
        except ShiftError as e:
            differ(placed, "", fact.subject, None, f"the core refuses it: {e.detail}")
        self.checked[fact.subject] += 1

    def gap(self, following: FactAtPlace) -> None:
        """Raise which message is lost before ``following``."""
        why = f"number {self.sequence + 1} of the recorder's messages is not in the recording"
        is_missing(self._lost_subject(following.fact), self.sequence + 1, following.place, why)

    def _lost_subject(self, following: Fact) -> str:
        if self.start is None:
            return "session"
        version = self.state.config.version if self.state else 0
        if version < max([1, self.claimed, *self.versions]) and version + 1 not in self.versions:
            return "config"
        live = self.state is not None and accepts_input(self.state.fact.state)
        return "session" if live and isinstance(following, Session) and has_ended(following.state) else "marker"

    def _take_first(self, placed: FactAtPlace) -> None:
        if not isinstance(placed.fact, Session) or not accepts_input(placed.fact.state):
            differ(placed, "", placed.fact.subject, "session", "a recording begins with the session")
        self.start, self._place = placed.fact, placed.place

    def _take_second(self, start: Session, placed: FactAtPlace) -> None:
        """Derive the session and its first configuration, which answer one command."""
        config = placed.fact
        if not isinstance(config, Config):
            differ(placed, "", config.subject, "config", "a session's second message is its configuration")
        self.state = RecorderState(start, config, "")
        if self.study is None:
            return
        derived = step(None, _start_of(start, as_recorded(json.loads(self.study))), start.stamp)
        compare(FactAtPlace(placed.place - 1, placed.sequence - 1, start), derived.facts[0])
        compare(placed, derived.facts[1])

    def _take_later(self, state: RecorderState, placed: FactAtPlace) -> None:
        """Derive a later fact. If two session facts contradict each other, the difference is at the first one."""
        try:
            compare(placed, self._next(state, placed))
            if self.state is not None and isinstance(placed.fact, Config):
                self.state = replace(self.state, config=placed.fact)
        except Differs as e:
            place = self._place if isinstance(placed.fact, Session) else e.place
            raise Differs(place, e.difference) from e

    def _next(self, state: RecorderState, placed: FactAtPlace) -> Fact:
        fact, now = placed.fact, placed.fact.stamp
        match fact:
            case Session() if has_ended(fact.state):
                if state.fact.format == 1:  # in format 1 each attempt to finish had its own time
                    state = replace(state, fact=state.fact.model_copy(update={"stamp": now}))
                self.state = replace(state, fact=ended(state))
                return self.state.fact
            case Session():
                after = step(state, EndSession(command_id=END_ID, session=fact.session), now)
            case Config():
                patch = merge_patch_between(json.loads(state.config.study), json.loads(fact.study))
                change = Configure(command_id="change", session=fact.session, patch=patch, author=fact.author)
                after = step(state, change, now)
            case Marker():
                after = step(state, mark_command(fact), now)
            case _:
                differ(placed, "", fact.subject, None, "the recorder publishes no such message")
        if not after.facts:
            differ(placed, "", fact.subject, None, "the session had ended")
        self.state = after.state
        return after.facts[0]


def _start_of(start: Session, study: dict[str, Any]) -> StartSession:
    return StartSession(
        command_id=START_ID, session=start.session, participant=start.participant, study=study, seed=start.seed,
        condition=start.condition, replay_of=start.replay_of, software=start.software, revision=start.revision,
        shard=start.shard, format=start.format, covariates=start.covariates,
    )  # fmt: skip


def mark_command(fact: Marker) -> Mark:
    """Return the command that a marker answers."""
    return Mark(
        command_id=fact.marker_id, session=fact.session, text=fact.text, retracts=fact.retracts or None,
        author=fact.author,
    )  # fmt: skip
