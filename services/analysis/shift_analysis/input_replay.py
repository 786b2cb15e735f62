"""Give the inputs of a recording to a running mesh, which decides anew in a session of its own.

The order of the inputs is the one in which the original services read them: each decision is asked for when the mesh
has exactly the gaze, reports and configurations that the original decision was made from. The gateway waits until what
it acknowledged has been read, so the same program with the same seed makes the same decisions, whatever the speed.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from shift_monitor.area_step import PositionsWithHistory
from shift_monitor.gaze_input import ChunkWithHistory
from shift_recording.mcap.reader import Recording
from shift_recording.provenance import STUDY
from shift_recording.replay import Pacer, TimeLine
from shift_runtime.rest_client import RestClient
from shift_schemas.core_protocol import Step
from shift_schemas.errors import DamagedRecording
from shift_schemas.messages import (
    AoiPositions,
    Config,
    Configure,
    Decision,
    GazeChunk,
    Mark,
    Marker,
    Observation,
    Override,
    Performance,
    Policy,
    ReportPerformance,
    Result,
    ScoredResult,
    Session,
    SetOverride,
)
from shift_schemas.timestamps import Stamp
from shift_study.loading import as_recorded
from shift_study.patching import merge_patch_between
from shift_verify.verify import Observers, verify

Kind = Literal["gaze", "aois", "config", "decision", "performance", "override", "marker"]


@dataclass(frozen=True)
class RecordedInput:
    """One input, with its time in the original session."""

    kind: Kind
    at: Stamp
    content: Any
    """A gaze chunk, a configuration's patch, or the recorded fact."""


@dataclass
class _Inputs:
    """Collects the inputs of the monitor and of the learner while a recording is verified."""

    session: Session | None = None
    monitor: list[tuple[object, Stamp, int]] = field(default_factory=list)
    """Each input of the monitor, with the version of the observation that is in force after it."""
    learner: list[tuple[object, Stamp, int]] = field(default_factory=list)
    """Each input of the learner, with the version of the policy that is in force after it."""

    def on_monitor(self, event: object, now: Stamp, step: Step[Any]) -> None:
        last = step.facts[-1] if step.facts else None
        version = last.version if isinstance(last, Observation) else self.monitor[-1][2] if self.monitor else 0
        self.monitor.append((event, now, version))

    def on_learner(self, event: object, now: Stamp, step: Step[Any]) -> None:
        if isinstance(event, Session) and self.session is None:
            self.session = event
        last = step.facts[-1] if step.facts else None
        version = last.version if isinstance(last, Policy) else self.learner[-1][2] if self.learner else 0
        self.learner.append((event, now, version))


@dataclass(frozen=True)
class RecordedInputs:
    """The inputs of a recording: how its session was started, and what followed, in order."""

    session: Session
    study: dict[str, Any]
    inputs: tuple[RecordedInput, ...]

    @property
    def decisions(self) -> tuple[Decision, ...]:
        """The decisions of the recording."""
        return tuple(each.content for each in self.inputs if each.kind == "decision")


def read_inputs(path: Path) -> RecordedInputs:
    """Return the inputs of a recording.

    Raises
    ------
    DamagedRecording
        The recording does not verify, or it does not hold the session's start.
    UnknownThing
        There is no such file.
    """
    found = _Inputs()
    report = verify(path, observers=Observers(found.on_learner, found.on_monitor))
    if report.difference is not None:
        raise DamagedRecording(f"{path.name} does not verify: {report.difference.sentence}")
    recording = Recording(path)
    others = [r.fact for r in recording.facts(("override", "marker"))]
    study = recording.attachments.get(STUDY)
    if found.session is None or study is None:
        raise DamagedRecording(f"{path.name} does not hold the session's start and its study")
    return RecordedInputs(found.session, as_recorded(json.loads(study.data)), tuple(_Ordered(found, others).all()))


class _Ordered:
    """Puts the inputs into an order in which each decision has exactly the inputs that it had."""

    def __init__(self, found: _Inputs, others: list[Any]) -> None:
        self.found = found
        self.others = others
        self.monitor, self.learner, self.other = 0, 0, 0
        self.study: dict[str, Any] | None = None
        self.configured = 0
        self.reported: set[tuple[object, ...]] = set()
        self.out: list[RecordedInput] = []

    def all(self) -> list[RecordedInput]:
        """Return the inputs in order."""
        for event, _, _ in self.found.learner:
            if isinstance(event, Decision):
                self._monitor_until(event.versions.observation)
                self._learner_until(event.versions.policy)
                self._others_until(event.stamp)
                self.out.append(RecordedInput("decision", event.stamp, event))
        self._monitor_until(2**62)
        self._learner_until(2**62)
        self._others_until(Stamp.of(2**62))
        return self.out

    def _monitor_until(self, version: int) -> None:
        inputs = self.found.monitor
        while self.monitor < len(inputs):
            event, now, after = inputs[self.monitor]
            if after > version:
                return
            self._add(event, now)
            self.monitor += 1

    def _learner_until(self, version: int) -> None:
        inputs = self.found.learner
        while self.learner < len(inputs) and inputs[self.learner][2] <= version:
            self._add(*inputs[self.learner][:2])
            self.learner += 1

    def _others_until(self, until: Stamp) -> None:
        while self.other < len(self.others) and self.others[self.other].stamp.ns <= until.ns:
            fact = self.others[self.other]
            self.out.append(RecordedInput("override" if isinstance(fact, Override) else "marker", fact.stamp, fact))
            self.other += 1

    def _add(self, event: object, now: Stamp) -> None:
        match event:
            case ChunkWithHistory():
                self.out.append(RecordedInput("gaze", now, event.chunk))
            case PositionsWithHistory():
                self.out.append(RecordedInput("aois", now, event.positions))
            case Config() if event.version > self.configured:
                self._configure(event)
            case Performance():
                self._report(event.decision_id, event.corrects, now, event)
            case ReportPerformance():
                self._report(event.decision_id, event.corrects is not None, now, event)

    def _configure(self, event: Config) -> None:
        after = json.loads(event.study)
        if self.study is not None:
            patch = merge_patch_between(self.study, after)
            self.out.append(RecordedInput("config", event.stamp, patch))
        self.study, self.configured = after, event.version

    def _report(self, decision_id: str, corrects: bool, now: Stamp, event: Performance | ReportPerformance) -> None:
        """Add a report once: both the learner and the monitor have read it."""
        key = (decision_id, corrects, _result(event.comprehension), _result(event.enabledness))
        if key not in self.reported:
            self.reported.add(key)
            self.out.append(RecordedInput("performance", now, event))


def _result(given: Result | ScoredResult) -> tuple[bool, float]:
    return given.success, given.duration_s


@dataclass
class ReplayedDecisions:
    """How many decisions the mesh made, and the first one that differs from the recorded one."""

    made: int = 0
    different: list[str] = field(default_factory=list)
    """The ids of the decisions with another strategy, or with other probabilities."""
    late: int = 0
    """How many recorded decisions did not wait for all of their inputs, so that they cannot be made again for sure."""


async def replay_inputs(
    recorded: RecordedInputs, rest: RestClient, session: str, name: str, pacer: Pacer, longest_pause_s: float,
    on_progress: Callable[[float, int], None],
) -> ReplayedDecisions:  # fmt: skip
    """Give the inputs to the mesh at their times, and compare its decisions with the recorded ones.

    ``name`` is the recording's file, which a marker names. Raises the errors of the gateway.
    """
    begun, result, line = recorded.session, ReplayedDecisions(), TimeLine(longest_pause_s)
    await asyncio.to_thread(
        rest.start, begun.participant, session=session, study=recorded.study, seed=begun.seed,
        condition=begun.condition, covariates=begun.covariates or None,
    )  # fmt: skip
    await asyncio.to_thread(rest.command, Mark, session, text=f"replay of the inputs of {name}")
    latest = 0
    for count, each in enumerate(recorded.inputs, 1):
        latest = max(latest, each.at.ns)
        position_s = line.position_s(latest)
        await pacer.until(position_s)
        await asyncio.to_thread(_give, rest, session, each, result)
        on_progress(position_s, count)
    return result


def length_of(recorded: RecordedInputs, longest_pause_s: float) -> float:
    """Return the length of the inputs on their time line, s."""
    line, latest, length_s = TimeLine(longest_pause_s), 0, 0.0
    for each in recorded.inputs:
        latest = max(latest, each.at.ns)
        length_s = line.position_s(latest)
    return length_s


def _give(rest: RestClient, session: str, each: RecordedInput, result: ReplayedDecisions) -> None:
    """Give one input to the gateway."""
    content = each.content
    match content:
        case GazeChunk():
            rest.gaze(session, content)
        case AoiPositions():
            rest.aois(session, content)
        case Decision():
            answer = rest.decide(session, content.task, content.decision_id)
            result.made += 1
            result.late += content.stale or content.policy_source in ("last_policy", "scoring")
            if answer["strategy"] != content.strategy or answer["probabilities"] != content.probabilities:
                result.different.append(content.decision_id)
        case Performance() | ReportPerformance():
            _report(rest, session, content)
        case Override():
            body = {"withdraws": content.withdraws} if content.withdraws else {"strategy": content.strategy}
            rest.command(
                SetOverride, session, task=content.task, override_id=content.override_id, reason=content.reason,
                author=content.author, **body,
            )  # fmt: skip
        case Marker():
            retracts = {"retracts": content.retracts} if content.retracts else {}
            rest.command(
                Mark, session, marker_id=content.marker_id, text=content.text, author=content.author, **retracts
            )
        case dict():
            rest.command(Configure, session, **content)


def _report(rest: RestClient, session: str, content: Performance | ReportPerformance) -> None:
    results = {
        name: {"success": getattr(content, name).success, "duration_s": getattr(content, name).duration_s}
        for name in ("comprehension", "enabledness")
    }
    corrects = {"corrects": True} if content.corrects else {}
    fields = {"decision_id": content.decision_id, "author": content.author, **results, **corrects}
    rest.command(ReportPerformance, session, **fields)
