"""Makes a session's recording from its segments."""

from __future__ import annotations

import json
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from shift_recording.mcap.reader import Recording
from shift_recording.mcap.records import Attachment
from shift_recording.mcap.schemas import subject_schemas
from shift_recording.merging import FinishedRecording, finish_recording
from shift_recording.provenance import attachments_of, metadata_of
from shift_recording.segments import segments_of
from shift_schemas.errors import DamagedRecording
from shift_study.loading import study_from_json

from shift_recorder.core import RecorderState


def merge_session(session: str, state: RecorderState, recordings: Path, segments: Path) -> FinishedRecording:
    """Merge an earlier recording of the session, if there is one, with its segments; return the recording.

    It reads and writes the whole session, so it runs in a thread.
    """
    target = recordings / f"{session}.mcap"
    sources = [p for p in (target,) if p.exists()] + segments_of(segments, session)
    policies = first_and_last_policy(sources)
    states = tuple(json.loads(policies[0])["states"]) if policies else ()
    return finish_recording(
        session,
        sources,
        target,
        schemas=subject_schemas(study_from_json(state.config.study), states),
        metadata=metadata_of(state.fact, state.config),
        attachments=[
            Attachment(name, "application/json", data, state.fact.started.ns)
            for name, data in attachments_of(state.config, state.original, policies).items()
        ],
    )


def first_and_last_policy(sources: Iterable[Path]) -> tuple[bytes, bytes] | None:
    """Return the session's first and last policy by their numbers; a later source has what a damaged one lost."""
    first: tuple[int, bytes] | None = None
    last: tuple[int, bytes] | None = None
    for source in sources:
        with suppress(DamagedRecording):
            for message in Recording(source).messages({"policy"}):
                if first is None or message.sequence < first[0]:
                    first = (message.sequence, message.data)
                if last is None or message.sequence > last[0]:
                    last = (message.sequence, message.data)
    return (first[1], last[1]) if first is not None and last is not None else None
