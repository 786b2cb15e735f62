"""The recorder's own facts derived again: the session, its configurations, markers, and the file's front. Pure.

A start is derived from the attached study, a change of the configuration from the one before it.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from shift_recorder.core import RecorderState, ended, step
from shift_recording.mcap.records import Attachment
from shift_recording.provenance import STUDY, attachments_of, metadata_of
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

from shift_verify.difference import Difference, Differs, Placed, compare, differ, is_missing

LAST = 2**61
"""The front only repeats: where a message differs as well, that is the first difference."""


class Rerecord:
    """Session, configurations and markers. Hand each to :meth:`take` in the recorder's order.

    Parameters
    ----------
    study
        The attached study; a segment has none, and its start is then taken as it is.
    versions
        The configurations' versions that the recording has.
    claimed
        The largest that a service says it has seen.
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

    def take(self, placed: Placed) -> None:
        """The recorder's next fact. Raises :class:`Differs`."""
        fact, self.sequence = placed.fact, placed.sequence
        try:
            if self.start is None:
                self._begins(placed)
            elif self.state is None:
                self._starts(self.start, placed)
            else:
                self._goes_on(self.state, placed)
        except ShiftError as e:
            differ(placed, "", fact.subject, None, f"the core refuses it: {e.detail}")
        self.checked[fact.subject] += 1

    def gap(self, following: Placed) -> None:
        """Say what is lost before ``following``."""
        why = f"number {self.sequence + 1} of the recorder's messages is not in the recording"
        is_missing(self._lost(following.fact), self.sequence + 1, following.place, why)

    def _lost(self, following: Fact) -> str:
        if self.start is None:
            return "session"
        version = self.state.config.version if self.state else 0
        if version < max([1, self.claimed, *self.versions]) and version + 1 not in self.versions:
            return "config"
        live = self.state is not None and accepts_input(self.state.fact.state)
        return "session" if live and isinstance(following, Session) and has_ended(following.state) else "marker"

    def _begins(self, placed: Placed) -> None:
        if not isinstance(placed.fact, Session) or not accepts_input(placed.fact.state):
            differ(placed, "", placed.fact.subject, "session", "a session begins with its session")
        self.start, self._place = placed.fact, placed.place

    def _starts(self, start: Session, placed: Placed) -> None:
        """The session and its first configuration come of one command."""
        config = placed.fact
        if not isinstance(config, Config):
            differ(placed, "", config.subject, "config", "a session's second message is its configuration")
        self.state = RecorderState(start, config, "")
        if self.study is None:
            return
        derived = step(None, _start_of(start, as_recorded(json.loads(self.study))), start.stamp)
        compare(Placed(placed.place - 1, placed.sequence - 1, start), derived.facts[0])
        compare(placed, derived.facts[1])

    def _goes_on(self, state: RecorderState, placed: Placed) -> None:
        """Where two of the session's own messages contradict each other, everything after the first is in doubt."""
        try:
            compare(placed, self._next(state, placed))
            if self.state is not None and isinstance(placed.fact, Config):
                self.state = replace(self.state, config=placed.fact)
        except Differs as e:
            place = self._place if isinstance(placed.fact, Session) else e.place
            raise Differs(place, e.difference) from e

    def _next(self, state: RecorderState, placed: Placed) -> Fact:
        fact, now = placed.fact, placed.fact.stamp
        match fact:
            case Session() if has_ended(fact.state):
                if state.fact.format == 1:  # each attempt to finish had a time of its own then
                    state = replace(state, fact=state.fact.model_copy(update={"stamp": now}))
                self.state = replace(state, fact=ended(state))
                return self.state.fact
            case Session():
                after = step(state, EndSession(command_id=END_ID, session=fact.session), now)
            case Config():
                patch = merge_patch_between(json.loads(state.config.study), json.loads(fact.study))
                after = step(state, Configure(command_id="change", session=fact.session, patch=patch), now)
            case Marker():
                after = step(state, Mark(command_id=fact.marker_id, session=fact.session, text=fact.text), now)
            case _:
                differ(placed, "", fact.subject, None, "the recorder puts out no such thing")
        if not after.facts:
            differ(placed, "", fact.subject, None, "the session was over")
        self.state = after.state
        return after.facts[0]


def _start_of(start: Session, study: dict[str, Any]) -> StartSession:
    return StartSession(
        command_id=START_ID, session=start.session, participant=start.participant, study=study, seed=start.seed,
        condition=start.condition, replay_of=start.replay_of, software=start.software, revision=start.revision,
        format=start.format,
    )  # fmt: skip


def merge_patch_between(before: Any, after: Any) -> Any:
    """The JSON merge patch (RFC 7386) that makes ``after`` of ``before``."""
    if not isinstance(before, dict) or not isinstance(after, dict):
        return after
    patch = {key: merge_patch_between(before.get(key), v) for key, v in after.items() if before.get(key, ...) != v}
    return patch | dict.fromkeys(before.keys() - after.keys())


# --- what stands in front of the messages ---


def check_front(
    state: RecorderState,
    metadata: Mapping[str, Mapping[str, str]],
    attachments: Mapping[str, Attachment],
    policies: tuple[bytes, bytes] | None,
) -> None:
    """Compare metadata and attachments with the messages that they repeat. Raises :class:`Differs`."""
    for name, wanted in metadata_of(state.fact, state.config).items():
        found = metadata.get(name, {})
        for key, value in wanted.items():
            if found.get(key) != value:
                _front("metadata", f"{name}.{key}", found.get(key), value)
    for name, data in attachments_of(state.config, state.original, policies).items():
        if name == STUDY:
            continue  # an input: the session's start is derived from it
        there = attachments.get(name)
        if there is None or (there.data != data and _plain(there.data) != _plain(data)):
            _front("attachment", name, _plain(there.data) if there else None, _plain(data))


def _plain(data: bytes) -> Any:
    try:
        return json.loads(data)
    except (ValueError, RecursionError):
        return data.decode(errors="replace")


def _front(what: str, field: str, recorded: Any, wanted: Any) -> None:
    said = f"{what}: {field} does not say what the messages say"
    raise Differs(LAST, Difference(what, 0, field, recorded, wanted, said))
