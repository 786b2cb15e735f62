"""Derive the outputs of the monitor and of the learner again. Pure.

A group of the learner's facts ends with a policy, and one of the monitor's with an observation. Where the monitor holds
the observation of a chunk of gaze back (from format 4 on), the group ends with the chunk or with its last fixation, and
an observation of its own follows later.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NoReturn

from shift_learner import core as learner
from shift_monitor import core as monitor
from shift_monitor.area_step import PositionsWithHistory, RecordedPositions, positions_of
from shift_monitor.clock_ledger import EMPTY_LEDGER
from shift_monitor.gaze_input import ChunkWithHistory, RecordedChunk
from shift_schemas.core_protocol import Step
from shift_schemas.errors import ShiftError
from shift_schemas.lifecycle import accepts_input
from shift_schemas.messages import (
    Aois,
    Clock,
    Fact,
    Fixation,
    Gaze,
    Observation,
    Performance,
    Policy,
    ReportPerformance,
    Result,
    ScoredResult,
    Transition,
)
from shift_schemas.timestamps import Stamp

from shift_verify.difference import FactAtPlace, NotRecorded, differ
from shift_verify.inputs import Inputs
from shift_verify.output_fold import OnStep, OutputFold, ignore_step


class MonitorFold(OutputFold):
    """The monitor's outputs: gaze, fixations and observations."""

    closing = Observation
    state: monitor.MonitorState
    _stepped: Step[Any] | None = None
    """The step of the open group's chunk, from which its length was taken; :meth:`step` returns it once."""

    def __init__(self, inputs: Inputs, on_step: OnStep = ignore_step) -> None:
        super().__init__(inputs, on_step)
        self._numbers: dict[tuple[str, int], tuple[int, ...]] = {}
        self._position_numbers: dict[tuple[str, int], tuple[int, ...]] = {}
        """By source and chunk number: the segments in which the number was used."""
        self._last: FactAtPlace | None = None
        self._before_show: monitor.MonitorState | None = None
        """The state before the last group if that was an observation that had been held back."""
        self._gaze: ChunkWithHistory | None = None
        """The chunk of the open group."""
        self._length = 0
        """How many facts the open group of a chunk has without an observation; 0 if an observation ends it."""

    def take(self, placed: FactAtPlace) -> None:
        """Derive up to the owner's next fact. Raises :class:`Differs`, ``NotRecorded``."""
        self._last, self._before_show = placed, None
        if isinstance(placed.fact, Clock):
            self.state, self._stepped = with_unrecorded(self.state, placed.fact), None
        if not self.group:
            self._length, self._stepped = 0, None
            if isinstance(placed.fact, Gaze):
                self._gaze = self._gaze_input(placed.fact)
                self._length = self._length_without_observation(placed.fact, self._gaze)
            elif isinstance(placed.fact, Aois):
                self._length = 1
        super().take(placed)

    def ends_group(self, placed: FactAtPlace) -> bool:
        """Return whether this fact is the last one of the open group."""
        return isinstance(placed.fact, Observation) or len(self.group) == self._length

    def _length_without_observation(self, fact: Gaze, gaze: ChunkWithHistory) -> int:
        if self.inputs.session.format < 4:
            return 0
        try:
            self._stepped = self.step(self.state, gaze, fact.stamp)
        except (ShiftError, ValueError, LookupError):
            return 0  # the difference is found when the group is derived
        facts = self._stepped.facts
        return 0 if isinstance(facts[-1], Observation) else len(facts)

    def step(self, state: Any, event: object, now: Stamp) -> Step[Any]:
        """Return the step of the core, without waiting."""
        stepped, self._stepped = self._stepped, None
        if stepped is not None and event is self._gaze:
            return stepped
        return monitor.step(state, event, now, timed_out=True)

    def input_of(self, group: list[FactAtPlace]) -> object | None:
        """Return the input of a group: gaze is its own input; otherwise exactly one number in ``seen`` is higher."""
        first, last = group[0].fact, group[-1]
        if isinstance(first, Gaze):
            return self._gaze
        if isinstance(first, Aois):
            return self._positions_input(first)
        seen = last.fact.seen
        for subject in ("config", "decision", "performance"):
            before: int = getattr(self.state, subject)
            if getattr(seen, subject) > before:
                return self.inputs.get(subject, before + 1, last)
        if self.inputs.ending is None and not isinstance(last.fact, Observation):
            return None
        if self.state.held and len(group) == 1 and self._is_shown(last.fact):
            return monitor.Show()
        if self.inputs.ending is None or self.state.ended:
            _raise_without_input(last, self.inputs.complete)
        return self.inputs.ending

    def _is_shown(self, fact: Fact) -> bool:
        """Return whether an observation is the one that was held back; the session's end publishes one as well."""
        if self.inputs.ending is None or self.state.ended:
            return True
        self._before_show = self.state
        return self.step(self.state, monitor.Show(), fact.stamp).facts == (fact,)

    def end(self) -> None:
        """Derive the rest. An observation that is held back and the one of the session's end can be the same."""
        before, ending = self._before_show, self.inputs.ending
        if before is not None and self._last is not None and ending is not None and not self.state.ended:
            self.state, self.group = before, [self._last]
            self.checked[self._last.fact.subject] -= 1
            self.state = self._derive(ending, whole=True).state
            self.group = []
        super().end()

    def _gaze_input(self, fact: Gaze) -> ChunkWithHistory:
        """Return the chunk with the segments of its source that had its number before, which show a restart."""
        used = self._numbers.setdefault((fact.source, fact.seq), ())
        self._numbers[fact.source, fact.seq] = (*used, fact.segment)
        return ChunkWithHistory(monitor.gaze_chunk_of(fact), tuple(RecordedChunk(segment) for segment in used))

    def _positions_input(self, fact: Aois) -> PositionsWithHistory:
        """Return moving AOIs with the segments in which their number was used before."""
        used = self._position_numbers.setdefault((fact.source, fact.seq), ())
        self._position_numbers[fact.source, fact.seq] = (*used, fact.segment)
        return PositionsWithHistory(positions_of(fact), tuple(RecordedPositions(segment) for segment in used))

    def remaining(self) -> Iterator[Fact]:
        """Yield the inputs that have not been applied."""
        for subject in ("config", "decision", "performance"):
            for n in range(getattr(self.state, subject) + 1, self.inputs.last(subject) + 1):
                yield self.inputs.numbered[subject][n]
        if self.inputs.ending is not None and not self.state.ended:
            yield self.inputs.ending

    def lost_subject(self, following: Fact) -> str:
        """Return the subject of the message that is lost before ``following``."""
        if isinstance(following, Fixation):
            return "gaze" if self._has_new_gaze(following) else "observation"
        if isinstance(following, Gaze) and self.inputs.session.format >= 4 and self._is_skipped_before(following):
            return "gaze"
        if isinstance(following, Observation) and following.version == self.state.version + 1:
            return "gaze" if self._has_new_gaze(following) else "fixation"
        return "observation"

    def _is_skipped_before(self, following: Gaze) -> bool:
        """Return whether numbers of the source are missing before a chunk."""
        stream = self.state.stream
        return stream is not None and stream.source == following.source and following.seq > stream.numbering.last + 1

    def _has_new_gaze(self, fact: Fact) -> bool:
        stream = self.state.stream
        before = {**self.state.former, stream.source: stream.numbering.last} if stream else {}
        return fact.seen.gaze != before


def with_unrecorded(state: monitor.MonitorState, clock: Clock) -> monitor.MonitorState:
    """Return the state with a ledger's counts of repeated and refused chunks, which nothing else records."""
    ledger = replace(
        state.ledgers.get(clock.source, EMPTY_LEDGER), repeated=clock.repeated, refused=dict(clock.refused)
    )
    return replace(state, ledgers={**state.ledgers, clock.source: ledger})


class LearnerFold(OutputFold):
    """The learner's outputs: performances, transitions and policies."""

    closing = Policy
    state: learner.LearnerState

    def step(self, state: Any, event: object, now: Stamp) -> Step[Any]:
        """Return the step of the core, without waiting."""
        return learner.step(state, event, now, timed_out=True)  # type: ignore[arg-type]

    def input_of(self, group: list[FactAtPlace]) -> object | None:
        """Return the input of a group: a performance's report, a configuration, a decision or the session's end."""
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
            _raise_without_input(last, self.inputs.complete)
        return self.inputs.ending

    def remaining(self) -> Iterator[Fact]:
        """Yield the inputs that have not been applied."""
        config = self.state.config.version if self.state.config else 0
        for subject, before in (("config", config), ("decision", self.state.decisions)):
            for n in range(before + 1, self.inputs.last(subject) + 1):
                yield self.inputs.numbered[subject][n]
        if self.inputs.ending is not None and accepts_input(self.state.phase):
            yield self.inputs.ending

    def lost_subject(self, following: Fact) -> str:
        """Return the subject of the message that is lost before ``following``."""
        if isinstance(following, Transition):
            return "performance"
        if isinstance(following, Policy) and following.version == self.state.version + 1:
            return "performance" if following.seen.performance > self.state.performances else "transition"
        return "policy"


def _report_of(fact: Performance) -> ReportPerformance:
    """Return the command that a performance records. The id of a correction is not recorded and changes nothing."""
    return ReportPerformance(
        command_id=fact.decision_id,
        session=fact.session,
        corrects=fact.decision_id if fact.corrects else None,
        comprehension=_result_of(fact.comprehension),
        enabledness=_result_of(fact.enabledness),
        author=fact.author,
    )


def _result_of(scored: ScoredResult) -> Result:
    return Result(success=scored.success, duration_s=scored.duration_s)


def _raise_without_input(last: FactAtPlace, complete: bool) -> NoReturn:
    if not complete:
        raise NotRecorded(f"{last.fact.subject} {last.sequence} follows from something that is not in the file yet")
    differ(last, "seen", last.fact.seen.model_dump(mode="json"), None, "it has seen no input that is new")
