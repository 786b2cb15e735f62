"""What the table of recordings says about one file: read once, in a process of its own."""

from __future__ import annotations

import json
from dataclasses import dataclass, field, replace
from pathlib import Path

from shift_recording.mcap.reader import Recording, fact_of
from shift_recording.mcap.writer import CONFIG_METADATA, SESSION_METADATA
from shift_schemas.errors import DamagedRecording, MalformedMessage, ShiftError
from shift_schemas.lifecycle import has_ended
from shift_schemas.messages import Config, Decision, Observation, Session

from shift_gateway.web.worker_process import Send

WORK = f"{__name__}:send_summaries"


@dataclass(frozen=True)
class RecordingSummary:
    """One recording, without deriving anything."""

    name: str
    session: str = ""
    participant: str = ""
    study: str = ""
    condition: str = ""
    blinded: bool = False
    """Whether the study says that the condition is not to be seen."""
    started_ns: int = 0
    ended_ns: int = 0
    """0 if the session has not ended."""
    decisions: int = 0
    lost: float | None = None
    """Share of the gaze source's time without a valid sample, 0..1, at the last observation; None if not recorded."""
    overrides: int = 0
    """Decisions that followed an override."""
    stale: int = 0
    changes: int = 0
    """Configurations after the first one."""
    reason: str = ""
    """Why the recording is not complete, or how it is damaged; empty if it is whole and the session ended."""


@dataclass
class _Counted:
    """What one pass over the messages finds."""

    session: Session | None = None
    study: str = ""
    configs: int = 0
    decisions: list[Decision] = field(default_factory=list)
    last_observation: bytes = b""

    def read(self, recording: Recording) -> None:
        """Read the file. Raises ``DamagedRecording``, ``MalformedMessage``."""
        for message in recording.messages(("session", "config", "observation", "decision")):
            if message.topic == "observation":
                self.last_observation = message.data
                continue
            match fact_of(message.topic, message.data):
                case Session() as session:
                    self.session = session
                case Config() as config:
                    self.configs, self.study = self.configs + 1, config.study
                case Decision() as decision:
                    self.decisions.append(decision)

    @property
    def lost(self) -> float | None:
        """The share of lost gaze at the last observation."""
        if not self.last_observation:
            return None
        fact = fact_of("observation", self.last_observation)
        return fact.gaze.lost if isinstance(fact, Observation) else None


def summary_of(path: Path) -> RecordingSummary:
    """Return the summary of a recording; a damaged or unfinished one is described as far as it can be read."""
    recording, counted = Recording(path), _Counted()
    reason, lost = "", None
    try:
        counted.read(recording)
        lost = counted.lost
    except (DamagedRecording, MalformedMessage) as e:
        reason = e.detail
    except ShiftError as e:
        return RecordingSummary(path.name, reason=e.detail)
    session = counted.session
    ended = session is not None and has_ended(session.state)
    summary = RecordingSummary(
        name=path.name,
        blinded=is_blinded(counted.study or recording.metadata.get(CONFIG_METADATA, {}).get("study", "")),
        decisions=len(counted.decisions),
        lost=lost,
        overrides=sum(d.policy_source == "override" for d in counted.decisions),
        stale=sum(d.stale for d in counted.decisions),
        changes=max(counted.configs - 1, 0),
        reason=reason_of(recording, reason) or ("" if ended else "the session has not ended"),
    )
    if session is None:
        said = recording.metadata.get(SESSION_METADATA, {})
        return replace(
            summary, session=said.get("session", ""), participant=said.get("participant", ""),
            study=said.get("study", ""), condition=said.get("condition", ""),
        )  # fmt: skip
    return replace(
        summary, session=session.session, participant=session.participant, study=session.study,
        condition=session.condition or "", started_ns=session.started.ns,
        ended_ns=session.ended.ns if session.ended else 0,
    )  # fmt: skip


def send_summaries(send: Send, *paths: str) -> None:
    """Send the summary of each recording."""
    for path in paths:
        send(summary_of(Path(path)))


def reason_of(recording: Recording, error: str) -> str:
    """Return why the file could not be read to its end, without its name."""
    report = recording.report
    return report.reason if report.damaged or not error else error


def is_blinded(study: str) -> bool:
    """Return whether the condition is to be hidden. It is if the study is not known."""
    try:
        return bool(json.loads(study).get("blinded", False))
    except ValueError:
        return True
