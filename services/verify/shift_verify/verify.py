"""Verify a recording: derive every output again from its inputs, and report the first difference.

First the checksum beside the file, then the file's own checksums and the order of each owner's messages, then the
folds (``recorder``, ``monitor_learner``, ``decider``), each over *recorded* inputs: so a changed message differs
itself, besides what follows from it. There are two passes over the file, because the monitor publishes nearly all
messages and they are not kept in memory.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from shift_recording.checksum import check
from shift_recording.mcap.writer import CONFIG_METADATA
from shift_recording.provenance import STUDY
from shift_schemas.errors import DamagedRecording
from shift_schemas.messages import Config, Observation
from shift_schemas.registry import SUBJECTS

from shift_verify.decider import decider_verification
from shift_verify.difference import Difference, Differs
from shift_verify.guarded_fold import GuardedFold
from shift_verify.inputs import Inputs
from shift_verify.monitor_learner import LearnerFold, MonitorFold
from shift_verify.output_fold import OnStep, ignore_step
from shift_verify.provenance import check_provenance
from shift_verify.recorded_messages import OnProgress, RecordedMessages
from shift_verify.recorder import RecorderFold


@dataclass(frozen=True)
class VerifyReport:
    """The result of verifying one recording.

    ``complete`` says whether the session ended and the file is whole. Of an unfinished recording the part that is
    there is verified, and ``reason`` says why it is not complete. ``checked`` counts the messages that are as derived,
    by subject, up to the first difference of each owner.
    """

    file: str
    ok: bool
    complete: bool
    checksum: Literal["matches", "missing", "differs"]
    checked: dict[str, int]
    difference: Difference | None
    reason: str = ""

    def as_json(self) -> dict[str, Any]:
        """Return the report as ``--json`` prints it."""
        difference = self.difference.as_json() if self.difference else None
        return {
            "file": self.file, "ok": self.ok, "complete": self.complete, "checksum": self.checksum,
            "checked": self.checked, "difference": difference, "reason": self.reason,
        }  # fmt: skip


@dataclass(frozen=True)
class Observers:
    """Functions that are called with the inputs of the learner and of the monitor while both are derived again.

    The learner is derived first. An observer reads the steps; it does not change them.
    """

    learner: OnStep = ignore_step
    monitor: OnStep = ignore_step


def verify(path: Path, on_progress: OnProgress | None = None, observers: Observers = Observers()) -> VerifyReport:
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
    verification = _Verification(path, on_progress, observers)
    verification.run()
    checked = verification.checked
    first = min(verification.differences, key=lambda d: d.rank, default=None)
    return VerifyReport(
        file=path.name,
        ok=first is None,
        complete=verification.messages.complete,
        checksum="matches" if checksum == "matches" else "missing",
        checked={s: checked[s] for s in SUBJECTS if checked[s]},
        difference=first.difference if first else None,
        reason="; ".join(verification.reasons),
    )


class _Verification:
    """One run over a recording."""

    def __init__(self, path: Path, on_progress: OnProgress | None, observers: Observers) -> None:
        self.messages = RecordedMessages(path)
        self.on_progress = on_progress
        self.observers = observers
        self.differences: list[Differs] = []
        self.reasons: list[str] = []
        """Why the recording is not complete, and where it does not say more."""
        self._folds: list[GuardedFold] = []

    @property
    def checked(self) -> Counter[str]:
        """The number of messages that are as derived, by subject."""
        return sum((fold.checked for fold in self._folds), Counter())

    def run(self) -> None:
        """Read, then derive; the differences are in ``differences``."""
        messages = self.messages
        try:
            messages.read()
            messages.check_file()
            self.reasons += [messages.reason] if messages.reason else []
            messages.check_order()
            messages.check_decision_numbers()
            self._derive()
        except Differs as e:
            self.differences.append(e)
        except DamagedRecording as e:
            self.differences.append(Differs(0, Difference("file", 0, "", None, None, e.detail)))

    def _derive(self) -> None:
        recorder = self._derive_recorder()
        inputs = self._inputs(recorder)
        if inputs is not None:
            self._derive_learner(inputs)
            self._derive_monitor_and_decider(inputs)
        recording = self.messages.recording
        if recorder.state is not None and CONFIG_METADATA in recording.metadata:
            check_provenance(recorder.state, recording.metadata, recording.attachments, self.messages.policies)

    def _derive_recorder(self) -> RecorderFold:
        study = self.messages.recording.attachments.get(STUDY)
        facts = self.messages.facts
        versions = frozenset(fact.version for fact in facts if isinstance(fact, Config))
        claimed = max((fact.seen.config for fact in facts), default=0)
        fold = RecorderFold(study.data if study else None, versions, claimed)
        if self._has_beginning("recorder"):
            self._take_all(self._guard("recorder", fold), "recorder")
        return fold

    def _inputs(self, recorder: RecorderFold) -> Inputs | None:
        if recorder.start is None:
            self.reasons = self.reasons or ["it does not hold the session's start"]
            return None
        inputs = Inputs(recorder.start, self.messages.complete)
        inputs.gaze = SUBJECTS.index("gaze") in self.messages.owners["monitor"].topic
        inputs.add(self.messages.facts)
        return inputs

    def _derive_learner(self, inputs: Inputs) -> None:
        if self._has_beginning("learner"):
            fold = self._guard("learner", LearnerFold(inputs, self.observers.learner))
            self._take_all(fold, "learner")
            fold.end()

    def _derive_monitor_and_decider(self, inputs: Inputs) -> None:
        """Derive both in the second pass: the decider gets each observation that is as derived."""
        if not self._has_beginning("monitor"):
            return
        monitor = self._guard("monitor", MonitorFold(inputs, self.observers.monitor))
        decider = None
        if self._has_beginning("decider"):
            outputs = self.messages.owners["decider"]
            decider = self._guard("decider", decider_verification(inputs, outputs.unbroken_facts, outputs.following))
        unbroken = self.messages.owners["monitor"].unbroken
        for i, placed in enumerate(self.messages.read_monitor(self.on_progress)):
            monitor.take(placed) if i < unbroken else monitor.gap(placed)
            if decider is not None and not monitor.differs and isinstance(placed.fact, Observation):
                decider.take(placed.fact)
        monitor.end()
        if decider is not None and not monitor.differs:
            decider.end()

    def _guard(self, owner: str, fold: Any) -> GuardedFold:
        guarded = GuardedFold(owner, fold, self.differences, self.reasons)
        self._folds.append(guarded)
        return guarded

    def _take_all(self, fold: GuardedFold, owner: str) -> None:
        outputs = self.messages.owners[owner]
        for placed in outputs.unbroken_facts:
            fold.take(placed)
        if (following := outputs.following) is not None:
            fold.gap(following)

    def _has_beginning(self, owner: str) -> bool:
        """Return whether the owner's outputs can be derived; if not, say why."""
        if self.messages.has_beginning(owner):
            return True
        first = self.messages.owners[owner].sequence[0]
        self.reasons.append(f"what the {owner} published before its message {first} is elsewhere")
        return False
