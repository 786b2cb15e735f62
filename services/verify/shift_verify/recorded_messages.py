"""The messages of a recording by owner: one pass over the file, and what its order and numbers must be."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from shift_recording.mcap.reader import RecordedMessage, Recording, fact_of
from shift_recording.mcap.writer import CONFIG_METADATA
from shift_schemas.errors import DamagedRecording, MalformedMessage, shorten
from shift_schemas.lifecycle import has_ended
from shift_schemas.messages import Decision, Fact, Session
from shift_schemas.registry import OWNER_OF, OWNERS, SUBJECTS

from shift_verify.difference import Difference, Differs, FactAtPlace, differ, name_of

OnProgress = Callable[[int, int], None]
"""Called now and then with the number of derived messages and the number of all messages."""
EVERY = 500


@dataclass
class OwnerMessages:
    """The messages of one owner: their numbers, topics and places, and their facts except the monitor's."""

    sequence: array[int] = field(default_factory=lambda: array("Q"))
    topic: array[int] = field(default_factory=lambda: array("B"))
    place: array[int] = field(default_factory=lambda: array("Q"))
    facts: list[FactAtPlace] = field(default_factory=list)
    """The facts; empty for the monitor, which publishes nearly all messages."""

    @cached_property
    def unbroken(self) -> int:
        """The number of messages without a gap from 1 on. Valid once all messages have been read."""
        return next((i for i, n in enumerate(self.sequence) if n != i + 1), len(self.sequence))

    @property
    def unbroken_facts(self) -> list[FactAtPlace]:
        """The facts before the first gap."""
        return self.facts[: self.unbroken]

    @property
    def following(self) -> FactAtPlace | None:
        """The fact after the first gap, if there is one."""
        return self.facts[self.unbroken] if self.unbroken < len(self.facts) else None


class RecordedMessages:
    """The messages of a recording. Call :meth:`read` first, then the checks."""

    def __init__(self, path: Path) -> None:
        self.recording = Recording(path)
        self.owners = {owner: OwnerMessages() for owner in OWNERS}
        self.policies: tuple[bytes, bytes] | None = None
        """The first and the last policy, as recorded."""
        self.complete = False
        """Whether the file is whole and the session ended."""
        self.reason = ""
        """Why it is not complete."""

    @property
    def facts(self) -> list[Fact]:
        """The facts of every owner except the monitor."""
        return [placed.fact for owner in self.owners.values() for placed in owner.facts]

    def read(self) -> None:
        """Read the file once. Raises :class:`Differs`, ``DamagedRecording``."""
        for place, message in enumerate(self.recording.messages()):
            owner = self.owners[_owner_of(message)]
            owner.sequence.append(message.sequence)
            owner.topic.append(SUBJECTS.index(message.topic))
            owner.place.append(place)
            if owner is not self.owners["monitor"]:
                owner.facts.append(_placed(place, message))
            if message.topic == "policy":
                self.policies = (self.policies[0] if self.policies else message.data, message.data)

    def read_monitor(self, on_progress: OnProgress | None) -> Iterator[FactAtPlace]:
        """Yield the monitor's messages in a second pass. Raises :class:`Differs`, ``DamagedRecording``."""
        mine = self.owners["monitor"]
        for i, message in enumerate(self.recording.messages(OWNERS["monitor"]), start=1):
            yield _placed(mine.place[i - 1], message)
            if on_progress is not None and (i % EVERY == 0 or i == len(mine.place)):
                on_progress(i, len(mine.place))

    def check_file(self) -> None:
        """Find out whether the recording is complete. Raise :class:`Differs` if a finished file is not whole."""
        report = self.recording.report
        if not self.recording.library and not any(owner.sequence for owner in self.owners.values()):
            self._raise_file("it does not even begin as a recording does, so there is nothing to verify")
        if not report.complete and CONFIG_METADATA in self.recording.metadata:
            # A finished file is put in its place at once, so it is whole unless it was damaged.
            self._raise_file(f"it is not whole: {report.reason}")
        sessions = [p.fact for p in self.owners["recorder"].facts if isinstance(p.fact, Session)]
        self.complete = report.complete and bool(sessions) and has_ended(sessions[-1].state)
        self.reason = "" if self.complete else report.reason or "the session has not ended"

    def _raise_file(self, why: str) -> None:
        raise Differs(0, Difference("file", 0, "", None, None, f"{self.recording.path.name}: {why}"))

    def check_order(self) -> None:
        """Raise :class:`Differs` unless the messages of each owner are in the order of its sequence, each once."""
        for owner in self.owners.values():
            i = owner.unbroken
            if i < len(owner.sequence) and (owner.sequence[i] <= i or i + 1 in owner.sequence[i:]):
                _raise_out_of_order(SUBJECTS[owner.topic[i]], owner.place[i], owner.sequence[i], i + 1)

    def check_decision_numbers(self) -> None:
        """Raise :class:`Differs` at a decision whose number alone is wrong.

        Where the numbers after it continue from it, decisions are missing: what others have seen shows which.
        """
        decisions = [p for p in self.owners["decider"].unbroken_facts if isinstance(p.fact, Decision)]
        numbers = [p.fact.n for p in decisions if isinstance(p.fact, Decision)]
        i = next((i for i, n in enumerate(numbers) if n != i + 1), len(numbers))
        if i < len(numbers) and numbers[i + 1 : i + 2] != [numbers[i] + 1]:
            differ(decisions[i], "n", numbers[i], i + 1)

    def has_beginning(self, owner: str) -> bool:
        """Return whether the first message of the owner is there. A later segment does not have it."""
        mine = self.owners[owner]
        return self.complete or not mine.sequence or mine.sequence[0] == 1


def _placed(place: int, message: RecordedMessage) -> FactAtPlace:
    """Return the fact of a message. Raise :class:`Differs` if it is not valid, or its stamp differs from the file's."""
    try:
        placed = FactAtPlace(place, message.sequence, fact_of(message.topic, message.data))
    except MalformedMessage as e:
        name = name_of(message.topic, message.sequence)
        difference = Difference(message.topic, message.sequence, "", None, None, f"{name}: {e.detail}")
        raise Differs(place, difference) from e
    if placed.fact.stamp.ns != message.publish_time:
        differ(placed, "stamp", placed.fact.stamp.ns, message.publish_time, "its stamp is not its time of publication")
    return placed


def _owner_of(message: RecordedMessage) -> str:
    if message.topic not in OWNER_OF:
        raise DamagedRecording(f"it has the topic {shorten(message.topic)!r}, which is not a topic of a recording")
    return OWNER_OF[message.topic]


def _raise_out_of_order(subject: str, place: int, sequence: int, expected: int) -> None:
    sentence = f"{name_of(subject, sequence)} stands where message {expected} of its owner should"
    raise Differs(place, Difference(subject, sequence, "sequence", sequence, expected, sentence), missing=True)
