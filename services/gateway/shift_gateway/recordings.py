"""The folder of recordings, as the REST door shows it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from shift_schemas.ids import is_id


def recording_path(folder: Path, name: str) -> Path | None:
    """The file of that name, a recording or a checksum; none for any other name or where there is none."""
    stem = name.removesuffix(".sha256")
    if not stem.endswith(".mcap") or not is_id(stem.removesuffix(".mcap")):
        return None
    path = folder / name
    return path if path.is_file() else None


def list_recordings(folder: Path, sessions: dict[str, dict[str, Any]]) -> list[dict[str, Any]]:
    """Every recording in the folder, with what is known of its session."""
    found = []
    for path in sorted(folder.glob("*.mcap")) if folder.is_dir() else []:
        session = sessions.get(path.stem, {})
        found.append(
            {
                "name": path.name,
                "session": path.stem,
                "participant": session.get("participant"),
                "bytes": path.stat().st_size,
                "started": session.get("started"),
                "ended": session.get("ended"),
            }
        )
    return found
