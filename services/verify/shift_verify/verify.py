"""Verify: every output of a recording derived again from its inputs, and the first difference.

First the checksum beside the file, then the file's own checksums and the order of each owner's messages,
then the folds (``refolding``, ``redeciding``, ``rerecording``), each from *recorded* inputs: so a message
that was changed differs itself, before what follows from it. Two passes over the file; what the monitor
put out, nearly all there is, is not kept in memory.
"""

from __future__ import annotations

from array import array
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

from shift_recording.checksum import check
from shift_recording.mcap.reader import RecordedMessage, Recording, fact_of
from shift_recording.mcap.writer import CONFIG_METADATA
from shift_recording.provenance import STUDY
from shift_schemas.errors import DamagedRecording, MalformedMessage, ShiftError, shorten
from shift_schemas.lifecycle import has_ended, is_ending
from shift_schemas.messages import Config, Fact, Observation, Session
from shift_schemas.registry import OWNER_OF, OWNERS, SUBJECTS

from shift_verify.decider import decider_verification
from shift_verify.difference import Difference, Differs, NotRecorded, Placed, differ, name_of
from shift_verify.monitor_learner import Inputs, LearnerRefold, MonitorRefold
from shift_verify.recorder import LAST, Rerecord, check_front

Progress = Callable[[int, int], None]
"""Told now and then how many messages of how many are derived."""
EVERY = 500

NUMBER = {"config": "version", "decision": "n", "performance": "n", "policy": "version"}
"""Which field numbers the inputs of other services."""


@dataclass(frozen=True)
class VerifyReport:
    """What verify found.

    ``complete`` is whether the session ended and the file is whole; of an unfinished recording what there
    is was verified, and ``reason`` says why it is not complete. ``checked`` counts the messages that are
    what they must be, by subject, as far as they were looked at.
    """

    file: str
    ok: bool
    complete: bool
    checksum: Literal["matches", "missing", "differs"]
    checked: dict[str, int]
    difference: Difference | None
    reason: str = ""

    def as_json(self) -> dict[str, Any]:
        """For ``--json``."""
        difference = self.difference.as_json() if self.difference else None
        return {
            "file": self.file, "ok": self.ok, "complete": self.complete, "checksum": self.checksum,
            "checked": self.checked, "difference": difference, "reason": self.reason,
        }  # fmt: skip


def verify(path: Path, on_progress: Progress | None = None) -> VerifyReport:
    """Verify one recording, finished or not.

    Raises
    ------
    UnknownThing
        There is no such file.
    """
    try:
        checksum = check(path).value
    except DamagedRecording as e:
        difference = Difference("checksum", 0, "", None, None, e.detail)
        return VerifyReport(path.name, False, False, "differs", {}, difference)
    found = _Verification(path, on_progress)
    found.run()
    checked = found.checked
    first = min(found.differences, key=lambda d: d.rank, default=None)
    return VerifyReport(
        file=path.name,
        ok=first is None,
        complete=found.complete,
        checksum="matches" if checksum == "matches" else "missing",
        checked={s: checked[s] for s in SUBJECTS if checked[s]},
        difference=first.difference if first else None,
        reason=found.reason,
    )


@dataclass
class _Owner:
    """One owner's messages: where each is, and up to where there is no gap."""

    sequence: array[int] = field(default_factory=lambda: array("Q"))
    topic: array[int] = field(default_factory=lambda: array("B"))
    place: array[int] = field(default_factory=lambda: array("Q"))
    facts: list[Placed] = field(default_factory=list)
    """Kept for every owner but the monitor."""

    @cached_property
    def unbroken(self) -> int:
        """How many come in order from 1 on; asked for when all have been read."""
        return next((i for i, n in enumerate(self.sequence) if n != i + 1), len(self.sequence))


class _Verification:
    def __init__(self, path: Path, on_progress: Progress | None) -> None:
        self.recording = Recording(path)
        self.on_progress = on_progress
        self.owners = {owner: _Owner() for owner in OWNERS}
        self.differences: list[Differs] = []
        self.folds: list[_Guarded] = []
        self.complete = False
        self.reason = ""
        self.policies: tuple[bytes, bytes] | None = None

    def run(self) -> None:
        """Read, then fold; what differs is in ``differences``."""
        try:
            self._read()
            self._judge_file()
            self._check_order()
            self._fold()
        except Differs as e:
            self.differences.append(e)
        except DamagedRecording as e:
            self.differences.append(Differs(0, Difference("file", 0, "", None, None, e.detail)))

    @property
    def checked(self) -> Counter[str]:
        """How many messages are what they must be, by subject."""
        return sum((guarded.fold.checked for guarded in self.folds), Counter())

    def _fold(self) -> None:
        recorder = self._rerecord()
        inputs = self._inputs(recorder)
        if inputs is not None:
            self._refold_learner(inputs)
            self._refold_monitor_and_decider(inputs)
        self._front(recorder)

    # --- reading ---

    def _read(self) -> None:
        for place, message in enumerate(self.recording.messages()):
            owner = self.owners[_owner_of(message)]
            owner.sequence.append(message.sequence)
            owner.topic.append(SUBJECTS.index(message.topic))
            owner.place.append(place)
            if owner is not self.owners["monitor"]:
                owner.facts.append(_placed(place, message))
            if message.topic == "policy":
                self.policies = (self.policies[0] if self.policies else message.data, message.data)

    def _judge_file(self) -> None:
        report = self.recording.report
        if not self.recording.library and not any(owner.sequence for owner in self.owners.values()):
            why = "it does not even begin as a recording does, so there is nothing to verify"
            raise Differs(0, Difference("file", 0, "", None, None, f"{self.recording.path.name}: {why}"))
        last = [p.fact for p in self.owners["recorder"].facts if isinstance(p.fact, Session)]
        ended = bool(last) and isinstance(last[-1], Session) and has_ended(last[-1].state)
        if not report.complete and CONFIG_METADATA in self.recording.metadata:
            why = f"it is not whole: {report.reason}"  # a finished file takes its place whole
            raise Differs(0, Difference("file", 0, "", None, None, f"{self.recording.path.name}: {why}"))
        self.complete = report.complete and ended
        self.reason = "" if self.complete else report.reason or "the session has not ended"

    def _check_order(self) -> None:
        """Each owner's messages stand in the file in the order of its sequence, each of them once."""
        for owner in self.owners.values():
            i = owner.unbroken
            if i < len(owner.sequence) and (owner.sequence[i] <= i or i + 1 in owner.sequence[i:]):
                _out_of_order(SUBJECTS[owner.topic[i]], owner.place[i], owner.sequence[i], i + 1)

    # --- folding ---

    def _rerecord(self) -> Rerecord:
        study = self.recording.attachments.get(STUDY)
        facts = [placed.fact for owner in self.owners.values() for placed in owner.facts]
        versions = frozenset(fact.version for fact in facts if isinstance(fact, Config))
        claimed = max((fact.seen.config for fact in facts), default=0)
        fold = Rerecord(study.data if study else None, versions, claimed)
        if self._begins("recorder"):
            self._all(self._guarded("recorder", fold), "recorder")
        return fold

    def _front(self, fold: Rerecord) -> None:
        if fold.state is not None and CONFIG_METADATA in self.recording.metadata:
            check_front(fold.state, self.recording.metadata, self.recording.attachments, self.policies)

    def _inputs(self, recorder: Rerecord) -> Inputs | None:
        if recorder.start is None:
            self.reason = self.reason or "it does not hold the session's start"
            return None
        inputs = Inputs(recorder.start, self.complete, numbered={subject: {} for subject in NUMBER})
        inputs.gaze = SUBJECTS.index("gaze") in self.owners["monitor"].topic
        for placed in (p for owner in self.owners.values() for p in owner.facts):
            _note(inputs, placed.fact)
        return inputs

    def _refold_learner(self, inputs: Inputs) -> None:
        if self._begins("learner"):
            fold = self._guarded("learner", LearnerRefold(inputs))
            self._all(fold, "learner")
            fold.end()

    def _refold_monitor_and_decider(self, inputs: Inputs) -> None:
        """The second pass: the decider takes in the observations as they are derived."""
        if not self._begins("monitor"):
            return
        monitor = self._guarded("monitor", MonitorRefold(inputs))
        decider = None
        if self._begins("decider"):
            fold = decider_verification(inputs, self._unbroken("decider"), self._following("decider"))
            decider = self._guarded("decider", fold)
        unbroken = self.owners["monitor"].unbroken
        for i, placed in enumerate(self._monitored()):
            monitor.take(placed) if i < unbroken else monitor.gap(placed)
            if decider is not None and isinstance(placed.fact, Observation):
                decider.take(placed.fact)
        monitor.end()
        if decider is not None:
            decider.end()

    def _monitored(self) -> Iterator[Placed]:
        """What the monitor put out, read again."""
        mine = self.owners["monitor"]
        for i, message in enumerate(self.recording.messages(OWNERS["monitor"]), start=1):
            yield _placed(mine.place[i - 1], message)
            if self.on_progress is not None and (i % EVERY == 0 or i == len(mine.place)):
                self.on_progress(i, len(mine.place))

    # --- pieces ---

    def _guarded(self, owner: str, fold: Any) -> _Guarded:
        guarded = _Guarded(owner, fold, self)
        self.folds.append(guarded)
        return guarded

    def _all(self, fold: _Guarded, owner: str) -> None:
        for placed in self._unbroken(owner):
            fold.take(placed)
        if (following := self._following(owner)) is not None:
            fold.gap(following)

    def _unbroken(self, owner: str) -> list[Placed]:
        return self.owners[owner].facts[: self.owners[owner].unbroken]

    def _following(self, owner: str) -> Placed | None:
        mine = self.owners[owner]
        return mine.facts[mine.unbroken] if mine.unbroken < len(mine.facts) else None

    def _begins(self, owner: str) -> bool:
        """Whether the owner's beginning is there: a later segment does not hold it, and is not folded."""
        mine = self.owners[owner]
        if self.complete or not mine.sequence or mine.sequence[0] == 1:
            return True
        self.reason += f"; what the {owner} put out before its message {mine.sequence[0]} is elsewhere"
        return False


class _Guarded:
    """A fold that stops at the first difference, or where an unfinished recording tells no more."""

    def __init__(self, owner: str, fold: Any, verification: _Verification) -> None:
        self.owner = owner
        self.fold = fold
        self.verification = verification
        self.stopped = False

    def take(self, given: Placed | Observation) -> None:
        """The next fact."""
        self._do(self.fold.take, given)

    def gap(self, following: Placed) -> None:
        """What came next is lost."""
        self._do(self.fold.gap, following)
        self.stopped = True

    def end(self) -> None:
        """No more comes."""
        self._do(self.fold.end)

    def _do(self, action: Callable[..., None], *given: object) -> None:
        if self.stopped:
            return
        self.stopped = True
        try:
            action(*given)
            self.stopped = False
        except Differs as e:
            self.verification.differences.append(e)
        except NotRecorded as e:
            self.verification.reason += f"; {e}"
        except (
            ShiftError,
            ValueError,
            LookupError,
            TypeError,
            AssertionError,
        ) as e:  # nonsense that the core was given
            why = f"the {self.owner}'s core cannot go on with what is recorded: {shorten(str(e))}"
            self.verification.differences.append(Differs(LAST, Difference(self.owner, 0, "", None, None, why)))


def _note(inputs: Inputs, fact: Fact) -> None:
    """Keep a fact that others take in, and what its owner says that it has seen."""
    if (name := NUMBER.get(fact.subject)) is not None:
        inputs.numbered[fact.subject][getattr(fact, name)] = fact
    if isinstance(fact, Session) and is_ending(fact.state):
        inputs.ending = fact
    for subject in ("decision", "performance"):
        inputs.claimed[subject] = max(inputs.claimed.get(subject, 0), getattr(fact.seen, subject))


def _placed(place: int, message: RecordedMessage) -> Placed:
    """The fact that a message is. Raises :class:`Differs` where it is none, or is not filed as what it is."""
    try:
        placed = Placed(place, message.sequence, fact_of(message.topic, message.data))
    except MalformedMessage as e:
        name = name_of(message.topic, message.sequence)
        difference = Difference(message.topic, message.sequence, "", None, None, f"{name}: {e.detail}")
        raise Differs(place, difference) from e
    if placed.fact.stamp.ns != message.publish_time:
        differ(placed, "stamp", placed.fact.stamp.ns, message.publish_time, "its stamp is not its time of publication")
    return placed


def _owner_of(message: RecordedMessage) -> str:
    if message.topic not in OWNER_OF:
        raise DamagedRecording(f"it has the topic {shorten(message.topic)!r}, which is none of ours")
    return OWNER_OF[message.topic]


def _out_of_order(subject: str, place: int, sequence: int, expected: int) -> None:
    sentence = f"{name_of(subject, sequence)} stands where message {expected} of its owner should"
    raise Differs(place, Difference(subject, sequence, "sequence", sequence, expected, sentence), missing=True)
