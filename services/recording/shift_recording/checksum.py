"""The checksum beside a finished recording, as ``sha256sum`` writes and checks it.

It finds every flipped bit; of the checksums within an MCAP file, 15 to 36 % pass unseen (DESIGN.md).
"""

from __future__ import annotations

import hashlib
import re
from enum import Enum
from pathlib import Path

from shift_schemas.errors import DamagedRecording, UnknownThing, shorten

from shift_recording.durable_file import DurableFile, replace

_LINE = re.compile(r"([0-9a-f]{64}) [ *].+\n?")


class Checksum(Enum):
    """What can be said of a recording that is not damaged."""

    MATCHES = "matches"
    MISSING = "missing"


def checksum_path(recording: Path) -> Path:
    """``NAME.mcap.sha256``."""
    return recording.with_name(f"{recording.name}.sha256")


def sha256_of(path: Path) -> str:
    """The file's SHA-256, in hex. Raises :class:`UnknownThing`, :class:`DamagedRecording` if it cannot be read."""
    try:
        with open(path, "rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except FileNotFoundError as e:
        raise UnknownThing(f"there is no recording {path.name}") from e
    except OSError as e:
        raise DamagedRecording(f"{path.name} cannot be read: {e.strerror}") from e


def write_checksum(recording: Path, sha256: str) -> Path:
    """Writes the checksum file, durably and at once. Raises :class:`StorageFailed`."""
    target = checksum_path(recording)
    temporary = target.with_name(f".{target.name}.partial")
    file = DurableFile(temporary, new=False)
    try:
        file.write(f"{sha256}  {recording.name}\n".encode())
        file.sync()
    finally:
        file.close()
    replace(temporary, target)
    return target


def check(recording: Path) -> Checksum:
    """Compares a recording with the checksum beside it.

    Raises
    ------
    DamagedRecording
        It differs; names the file, what was expected and what was found.
    UnknownThing
        There is no such recording.
    """
    found = sha256_of(recording)
    expected = _expected(checksum_path(recording))
    if expected is None:
        return Checksum.MISSING
    if expected != found:
        raise DamagedRecording(f"{recording.name}: its SHA-256 should be {expected} and is {found}")
    return Checksum.MATCHES


def _expected(path: Path) -> str | None:
    try:
        with open(path, "rb") as stream:
            text = stream.read(4096).decode(errors="replace")
    except FileNotFoundError:
        return None
    except OSError as e:
        raise DamagedRecording(f"{path.name} cannot be read: {e.strerror}") from e
    line = _LINE.match(text)
    if line is None:
        raise DamagedRecording(f"{path.name} is no checksum file: {shorten(text)!r}")
    return line[1]
