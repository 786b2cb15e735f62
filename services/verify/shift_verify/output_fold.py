"""Derive the outputs of one owner again, through its own core, from the inputs that it read. Pure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from typing import Any

from shift_schemas.core_protocol import Step
from shift_schemas.errors import ShiftError
from shift_schemas.messages import Fact
from shift_schemas.timestamps import Stamp

from shift_verify.difference import FactAtPlace, compare, differ, is_missing
from shift_verify.inputs import Inputs

OnStep = Callable[[object, Stamp, Step[Any]], None]
"""Called with each input of an owner, its time, and the step that was derived from it; the first is the session."""


def ignore_step(event: object, now: Stamp, step: Step[Any]) -> None:
    """Do nothing with a step."""


class OutputFold:
    """The outputs of one owner. Hand each to :meth:`take` in the owner's order, then call :meth:`end`.

    The owner publishes a group of facts for each input. Each group ends with the same subject, whose ``seen`` says
    which input it was, so the order of the inputs is read from the outputs.
    """

    closing: type[Fact]
    """The type of the fact that ends each group."""

    def __init__(self, inputs: Inputs, on_step: OnStep = ignore_step) -> None:
        self.inputs = inputs
        self.on_step = on_step
        self.group: list[FactAtPlace] = []
        self.checked: Counter[str] = Counter()
        self.sequence = 0
        first = self.step(None, inputs.session, inputs.session.stamp)
        self.state: Any = first.state
        on_step(inputs.session, inputs.session.stamp, first)

    def step(self, state: Any, event: object, now: Stamp) -> Step[Any]:
        """Return the step of the core, without waiting."""
        raise NotImplementedError

    def input_of(self, group: list[FactAtPlace]) -> object | None:
        """Return the input of this group, or ``None`` if the group is unfinished and does not say."""
        raise NotImplementedError

    def remaining(self) -> Iterator[Fact]:
        """Yield the inputs that have not been applied."""
        raise NotImplementedError

    def lost_subject(self, following: Fact) -> str:
        """Return the subject of the message that is lost before ``following``, if no group is open."""
        raise NotImplementedError

    def take(self, placed: FactAtPlace) -> None:
        """Derive up to the owner's next fact. Raises :class:`Differs`, ``NotRecorded``."""
        self.group.append(placed)
        self.sequence = placed.sequence
        if self.ends_group(placed):
            event = self.input_of(self.group)
            assert event is not None
            self.state = self._derive(event, whole=True).state
            self.group = []

    def ends_group(self, placed: FactAtPlace) -> bool:
        """Return whether this fact is the last one of the open group."""
        return isinstance(placed.fact, self.closing)

    def gap(self, following: FactAtPlace) -> None:
        """Raise which message is lost before ``following``."""
        self._end_group(following.place)
        why = f"number {self.sequence + 1} of its sequence is not in the recording"
        is_missing(self.lost_subject(following.fact), self.sequence + 1, following.place, why)

    def end(self) -> None:
        """Derive the rest: no more outputs follow. Raise what is missing if the recording is whole."""
        place = self.group[-1].place + 1 if self.group else 2**62
        if self.group or not self.inputs.complete:
            self._end_group(place)
            return
        for event in self.remaining():
            after = self.step(self.state, event, event.stamp)
            if after.facts:
                why = f"it follows from {event.subject}, which is in the recording"
                is_missing(after.facts[0].subject, self.sequence + 1, place, why, after.facts[0])
            self.state = after.state

    def _end_group(self, place: int) -> None:
        """Compare a group that was not closed, and raise what is missing of it if the recording is whole."""
        if not self.group or (event := self.input_of(self.group)) is None:
            return
        rest = self._derive(event, whole=False).facts[len(self.group) :]
        if rest and self.inputs.complete:
            is_missing(rest[0].subject, self.sequence + 1, place, "it follows from what is there", rest[0])

    def _derive(self, event: object, whole: bool) -> Step[Any]:
        group = self.group
        try:
            step = self.step(self.state, event, group[0].fact.stamp)
        except (ShiftError, ValueError, LookupError) as e:
            differ(group[0], "", group[0].fact.subject, None, f"its core refuses what it follows from: {e}")
        for recorded, derived in zip(group, step.facts, strict=False):
            if recorded.fact.subject != derived.subject and whole and len(group) < len(step.facts):
                why = f"{recorded.fact.subject} stands in its place"
                is_missing(derived.subject, recorded.sequence, recorded.place, why, derived)
            compare(recorded, derived)
        if len(group) > len(step.facts):
            extra = group[len(step.facts)]
            differ(extra, "", extra.fact.subject, None, "it does not follow from anything")
        self.checked.update(placed.fact.subject for placed in group)
        if whole:
            self.on_step(event, group[0].fact.stamp, step)
        return step
