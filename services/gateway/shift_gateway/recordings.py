"""The paths of the finished recordings: the list, and each file with its checksum."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from fastapi import FastAPI, Response
from fastapi.responses import FileResponse
from shift_schemas.errors import UnknownThing
from shift_schemas.ids import is_id

from shift_gateway.gateway import Gateway


def add_recordings(app: FastAPI, gateway: Gateway) -> None:
    """Add the paths."""

    @app.get("/v1/recordings", tags=["recordings"])
    async def recordings() -> dict[str, Any]:
        """Return the finished recordings."""
        sessions = {s["session"]: s for s in await gateway.api.sessions()}
        return {"recordings": list_recordings(gateway.recordings, sessions)}

    @app.get("/v1/recordings/{name}", tags=["recordings"], response_class=FileResponse)
    async def recording(name: str) -> Response:
        """Return a recording's file, or its checksum (``NAME.mcap.sha256``)."""
        path = recording_path(gateway.recordings, name)
        if path is None:
            raise UnknownThing(f"there is no recording {name[:80]}")
        media_type = "application/octet-stream" if path.suffix == ".mcap" else "text/plain"
        return FileResponse(path, media_type=media_type, filename=path.name)


def recording_path(folder: Path, name: str) -> Path | None:
    """Return the file of that name, a recording or a checksum; None for another name or a missing file."""
    stem = name.removesuffix(".sha256")
    if not stem.endswith(".mcap") or not is_id(stem.removesuffix(".mcap")):
        return None
    path = folder / name
    return path if path.is_file() else None


def list_recordings(folder: Path, sessions: dict[str, dict[str, Any]]) -> list[dict[str, Any]]:
    """Return every recording of the folder, with what is known of its session."""
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
