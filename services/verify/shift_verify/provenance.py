"""Verify the metadata and the attachments of a recording, which repeat what its messages say. Pure."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from shift_recorder.core import RecorderState
from shift_recording.mcap.records import Attachment
from shift_recording.provenance import STUDY, attachments_of, metadata_of

from shift_verify.difference import LAST, Difference, Differs


def check_provenance(
    state: RecorderState,
    metadata: Mapping[str, Mapping[str, str]],
    attachments: Mapping[str, Attachment],
    policies: tuple[bytes, bytes] | None,
) -> None:
    """Compare metadata and attachments with the messages that they repeat. Raises :class:`Differs`."""
    for name, wanted in metadata_of(state.fact, state.config).items():
        found = metadata.get(name, {})
        for key, value in wanted.items():
            if found.get(key) != value:
                _differ("metadata", f"{name}.{key}", found.get(key), value)
    for name, data in attachments_of(state.config, state.original, policies).items():
        if name == STUDY:
            continue  # it is an input: the session's start is derived from it
        there = attachments.get(name)
        if there is None or (there.data != data and _plain(there.data) != _plain(data)):
            _differ("attachment", name, _plain(there.data) if there else None, _plain(data))


def _plain(data: bytes) -> Any:
    try:
        return json.loads(data)
    except (ValueError, RecursionError):
        return data.decode(errors="replace")


def _differ(what: str, field: str, recorded: Any, wanted: Any) -> None:
    said = f"{what}: {field} does not repeat what the messages say"
    raise Differs(LAST, Difference(what, 0, field, recorded, wanted, said))
