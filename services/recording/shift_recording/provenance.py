"""The metadata and attachments of a recording: session, configuration, study and policies. Pure.

They repeat the messages for people and programs that do not read them; ``verify`` compares both.
"""

from __future__ import annotations

import json

from shift_schemas.messages import Config, Session
from shift_schemas.timestamps import Stamp

from shift_recording.mcap.writer import CONFIG_METADATA, SESSION_METADATA

STUDY = "study.json"
"""The attachment with the study as it was given, before its condition."""

FORMAT_IN_METADATA = 3
"""The first format that the metadata names: the recordings of earlier formats must stay as they are."""


def metadata_of(fact: Session, config: Config) -> dict[str, dict[str, str]]:
    """Return the metadata records by name; stamps are in seconds since the epoch, and '' means that there is none."""
    return {
        SESSION_METADATA: {
            "session": fact.session,
            "participant": fact.participant,
            "study": fact.study,
            "condition": fact.condition or "",
            "seed": str(fact.seed),
            "started": _seconds(fact.started),
            "ended": _seconds(fact.ended) if fact.ended else "",
            "replay_of": fact.replay_of,
            "software": f"shift-mesh/{fact.software}",
            "revision": fact.revision,
            **({"format": str(fact.format)} if fact.format >= FORMAT_IN_METADATA else {}),
        },
        CONFIG_METADATA: {"version": str(config.version), "study": config.study},
    }


def attachments_of(config: Config, original: str, policies: tuple[bytes, bytes] | None) -> dict[str, bytes]:
    """Return the attached JSON files by name; ``policies`` are the first and the last one, as recorded."""
    table = json.loads(config.study)["scoring"]["table"]
    files = {STUDY: original.encode(), "scoring-table.json": json.dumps(table, indent=1).encode()}
    return files | dict(zip(("policy-first.json", "policy-last.json"), policies or (), strict=False))


def _seconds(stamp: Stamp) -> str:
    return f"{stamp.sec}.{stamp.nsec:09d}"
