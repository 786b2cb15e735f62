"""Recordings on the command line: files, and folders of files."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from shift_schemas.errors import UnknownThing


def recordings_in(paths: Iterable[Path]) -> tuple[Path, ...]:
    """Return the recordings: files as given, and all ``*.mcap`` in folders, each once.

    Raises
    ------
    UnknownThing
        A path does not exist, or a folder has no recording.
    """
    found: dict[Path, None] = {}
    for path in paths:
        if path.is_dir():
            inside = sorted(path.glob("*.mcap"))
            if not inside:
                raise UnknownThing(f"the folder {path} has no recording (*.mcap)")
            found |= dict.fromkeys(inside)
        elif path.is_file():
            found[path] = None
        else:
            raise UnknownThing(f"there is no file {path}")
    return tuple(found)
