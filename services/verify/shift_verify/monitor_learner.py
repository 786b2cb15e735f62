"""Derive the outputs of the monitor and of the learner again. Pure.

A group of the monitor's facts ends with an observation, a group of the learner's facts with a policy.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NoReturn

from shift_learner import core as learner
from shift_monitor import core as monitor
from shift_monitor.gaze_input import ChunkWithHistory, RecordedChunk
from shift_schemas.core_protocol import Step
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
    Transition,
)
from shift_schemas.timestamps import Stamp

from shift_verify.difference import FactAtPlace, NotRecorded, differ
from shift_verify.inputs import Inputs
from shift_verify.output_fold import OutputFold


class MonitorFold(OutputFold):
    """The monitor's outputs: gaze, fixations and observations."""

    closing = Observation
    state: monitor.MonitorState

    def __init__(self, inputs: Inputs) -> None:
        super().__init__(inputs)
        self._numbers: dict[tuple[str, int], tuple[int, ...]] = {}
        """By source and chunk number: the segments in which the number was used."""

    def step(self, state: Any, event: object, now: Stamp) -> Step[Any]:
        """Return the step of the core, without waiting."""
        return monitor.step(state, event, now, timed_out=True)

    def input_of(self, group: list[FactAtPlace]) -> object | None:
        """Return the input of a group: gaze is its own input; otherwise exactly one number in ``seen`` is higher."""
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
            _raise_without_input(last, self.inputs.complete)
        return self.inputs.ending

    def _gaze_input(self, fact: Gaze) -> ChunkWithHistory:
        """Return the chunk with the segments of its source that had its number before, which show a restart."""
        used = self._numbers.setdefault((fact.source, fact.seq), ())
        self._numbers[fact.source, fact.seq] = (*used, fact.segment)
        return ChunkWithHistory(monitor.gaze_chunk_of(fact), tuple(RecordedChunk(segment) for segment in used))

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
        if isinstance(following, Observation) and following.version == self.state.version + 1:
            return "gaze" if self._has_new_gaze(following) else "fixation"
        return "observation"

    def _has_new_gaze(self, fact: Fact) -> bool:
        stream = self.state.stream
        before = {**self.state.former, stream.source: stream.numbering.last} if stream else {}
        return fact.seen.gaze != before


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
