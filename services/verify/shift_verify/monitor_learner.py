"""The monitor's and the learner's outputs derived again, through their own cores, from what they took in. Pure.

Both put out a group of facts per input, and each group ends with the same subject (an observation, a
policy) whose ``seen`` says which input it was: so the order of inputs is read from the outputs.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, NoReturn

from shift_learner import core as learner
from shift_monitor import core as monitor
from shift_monitor.gaze_input import Earlier, GazeInput
from shift_schemas.core_protocol import Step
from shift_schemas.errors import ShiftError
from shift_schemas.lifecycle import accepts_input
from shift_schemas.messages import (
    Fact,
    Fixation,
    Gaze,
    Observation,
    Performance,
    Policy,
    ReportPerformance,
    Result,
    ScoredResult,
    Session,
    Transition,
)
from shift_schemas.timestamps import Stamp

from shift_verify.difference import NotRecorded, Placed, compare, differ, is_missing


@dataclass
class Inputs:
    """What the services took in from each other, by its number, as far as the recording has it."""

    session: Session
    complete: bool
    ending: Session | None = None
    numbered: dict[str, dict[int, Fact]] = field(default_factory=dict)
    """config, decision, performance, policy: number -> fact."""
    claimed: dict[str, int] = field(default_factory=dict)
    """decision, performance: the largest number that any service but the monitor says it has seen."""
    gaze: bool = False
    """Whether there is any gaze."""

    def last(self, subject: str) -> int:
        """The largest number that there is."""
        return max(self.numbered[subject], default=0)

    def get(self, subject: str, n: int, by: Placed) -> Fact:
        """The input that ``by`` has seen.

        Raises
        ------
        Differs
            The recording is whole and does not have it.
        NotRecorded
            The recording goes on elsewhere.
        """
        if (found := self.numbered[subject].get(n)) is not None:
            return found
        return self._lacks(subject, n, by)

    def _lacks(self, subject: str, n: int, by: Placed) -> NoReturn:
        if not self.complete:
            raise NotRecorded(f"{by.fact.subject} {by.sequence} has seen {subject} {n}, which is not in the file yet")
        if n <= self.claimed.get(subject, 0):
            is_missing(subject, 0, by.place, f"number {n} of them has been seen by others")
        differ(by, f"seen.{subject}", getattr(by.fact.seen, subject), n - 1)


class Refold:
    """One owner's outputs, folded again. Hand each to :meth:`take` in the owner's order, then :meth:`end`."""

    closing: type[Fact]
    """The kind of fact that ends each group."""

    def __init__(self, inputs: Inputs) -> None:
        self.inputs = inputs
        self.group: list[Placed] = []
        self.checked: Counter[str] = Counter()
        self.sequence = 0
        self.state: Any = self.step(None, inputs.session, inputs.session.stamp).state

    def step(self, state: Any, event: object, now: Stamp) -> Step[Any]:
        """The core's step, without waiting."""
        raise NotImplementedError

    def input_of(self, group: list[Placed]) -> object | None:
        """The input that gave this group; none where an unfinished group does not tell."""
        raise NotImplementedError

    def left(self) -> Iterator[Fact]:
        """The inputs that have not been applied."""
        raise NotImplementedError

    def lost(self, following: Fact) -> str:
        """The subject of what is lost before ``following``, where no group is open."""
        raise NotImplementedError

    def take(self, placed: Placed) -> None:
        """The owner's next fact. Raises :class:`Differs`, :class:`NotRecorded`."""
        self.group.append(placed)
        self.sequence = placed.sequence
        if isinstance(placed.fact, self.closing):
            event = self.input_of(self.group)
            assert event is not None
            self.state = self._derive(event, whole=True).state
            self.group = []

    def gap(self, following: Placed) -> None:
        """Say what is lost before ``following``."""
        self._end_group(following.place)
        why = f"number {self.sequence + 1} of its sequence is not in the recording"
        is_missing(self.lost(following.fact), self.sequence + 1, following.place, why)

    def end(self) -> None:
        """No more comes: of a whole recording, nothing may be missing."""
        place = self.group[-1].place + 1 if self.group else 2**62
        if self.group or not self.inputs.complete:
            self._end_group(place)
            return
        for event in self.left():
            after = self.step(self.state, event, event.stamp)
            if after.facts:
                why = f"it follows from {event.subject}, which is in the recording"
                is_missing(after.facts[0].subject, self.sequence + 1, place, why, after.facts[0])
            self.state = after.state

    def _end_group(self, place: int) -> None:
        """A group that was not closed: what there is of it must be right, what is not there is missing."""
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
        return step


class MonitorRefold(Refold):
    """Gaze, fixations and observations."""

    closing = Observation
    state: monitor.MonitorState

    def __init__(self, inputs: Inputs) -> None:
        super().__init__(inputs)
        self._numbers: dict[tuple[str, int], tuple[int, ...]] = {}
        """Per source and chunk number: the segments in which it was used."""

    def step(self, state: Any, event: object, now: Stamp) -> Step[Any]:
        """See :class:`Refold`."""
        return monitor.step(state, event, now, timed_out=True)

    def input_of(self, group: list[Placed]) -> object | None:
        """Gaze is its own input; of the others exactly one is further than before."""
        first, last = group[0].fact, group[-1]
        if isinstance(first, Gaze):
            return self._gaze_input(first)
        seen = last.fact.seen
        for subject in ("config", "decision", "performance"):
            before: int = getattr(self.state, subject)
            if getattr(seen, subject) > before:
                return self.inputs.get(subject, before + 1, last)
        if self.inputs.ending is None and not isinstance(last.fact, Observation):
            return None
        if self.inputs.ending is None or self.state.ended:
            _came_from_nothing(last, self.inputs.complete)
        return self.inputs.ending

    def _gaze_input(self, fact: Gaze) -> GazeInput:
        """The chunk, and which segments of its source had its number before: by that a restart is told."""
        used = self._numbers.setdefault((fact.source, fact.seq), ())
        self._numbers[fact.source, fact.seq] = (*used, fact.segment)
        return GazeInput(monitor.gaze_chunk_of(fact), tuple(Earlier(segment) for segment in used))

    def left(self) -> Iterator[Fact]:
        """See :class:`Refold`."""
        for subject in ("config", "decision", "performance"):
            for n in range(getattr(self.state, subject) + 1, self.inputs.last(subject) + 1):
                yield self.inputs.numbered[subject][n]
        if self.inputs.ending is not None and not self.state.ended:
            yield self.inputs.ending

    def lost(self, following: Fact) -> str:
        """See :class:`Refold`."""
        if isinstance(following, Fixation):
            return "gaze" if self._has_new_gaze(following) else "observation"
        if isinstance(following, Observation) and following.version == self.state.version + 1:
            return "gaze" if self._has_new_gaze(following) else "fixation"
        return "observation"

    def _has_new_gaze(self, fact: Fact) -> bool:
        stream = self.state.stream
        before = {**self.state.former, stream.source: stream.numbering.last} if stream else {}
        return fact.seen.gaze != before


class LearnerRefold(Refold):
    """Performances, transitions and policies."""

    closing = Policy
    state: learner.LearnerState

    def step(self, state: Any, event: object, now: Stamp) -> Step[Any]:
        """See :class:`Refold`."""
        return learner.step(state, event, now, timed_out=True)  # type: ignore[arg-type]

    def input_of(self, group: list[Placed]) -> object | None:
        """A performance is its own input; else a configuration, a decision or the session's end."""
        first, last = group[0].fact, group[-1]
        if isinstance(first, Performance):
            return _report_of(first)
        if not isinstance(last.fact, Policy):
            return None
        config = self.state.config.version if self.state.config else 0
        for subject, before in (("config", config), ("decision", self.state.decisions)):
            if getattr(last.fact.seen, subject) > before:
                return self.inputs.get(subject, before + 1, last)
        if self.inputs.ending is None or not accepts_input(self.state.phase):
            _came_from_nothing(last, self.inputs.complete)
        return self.inputs.ending

    def left(self) -> Iterator[Fact]:
        """See :class:`Refold`."""
        config = self.state.config.version if self.state.config else 0
        for subject, before in (("config", config), ("decision", self.state.decisions)):
            for n in range(before + 1, self.inputs.last(subject) + 1):
                yield self.inputs.numbered[subject][n]
        if self.inputs.ending is not None and accepts_input(self.state.phase):
            yield self.inputs.ending

    def lost(self, following: Fact) -> str:
        """See :class:`Refold`."""
        if isinstance(following, Transition):
            return "performance"
        if isinstance(following, Policy) and following.version == self.state.version + 1:
            return "performance" if following.seen.performance > self.state.performances else "transition"
        return "policy"


def _report_of(fact: Performance) -> ReportPerformance:
    """The command that a performance records; a correction's own id is not recorded and changes nothing."""
    return ReportPerformance(
        command_id=fact.decision_id,
        session=fact.session,
        corrects=fact.decision_id if fact.corrects else None,
        comprehension=_result_of(fact.comprehension),
        enabledness=_result_of(fact.enabledness),
    )


def _result_of(scored: ScoredResult) -> Result:
    return Result(success=scored.success, duration_s=scored.duration_s)


def _came_from_nothing(last: Placed, complete: bool) -> NoReturn:
    if not complete:
        raise NotRecorded(f"{last.fact.subject} {last.sequence} follows from something that is not in the file yet")
    differ(last, "seen", last.fact.seen.model_dump(mode="json"), None, "nothing that it has seen is new")
