"""The checksum beside a finished recording, as ``sha256sum`` writes and checks it.

It finds every flipped bit. The checksums within an MCAP file alone miss 15 to 36 % of them (docs/design.md).
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
    """The result of comparing an undamaged recording with its checksum file."""

    MATCHES = "matches"
    MISSING = "missing"


def checksum_path(recording: Path) -> Path:
    """Return the path of the checksum file, ``NAME.mcap.sha256``."""
    return recording.with_name(f"{recording.name}.sha256")


def sha256_of(path: Path) -> str:
    """Return the file's SHA-256 in hex. Raises :class:`UnknownThing`, else :class:`DamagedRecording` if unreadable."""
    try:
        with open(path, "rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except FileNotFoundError as e:
        raise UnknownThing(f"there is no recording {path.name}") from e
    except OSError as e:
        raise DamagedRecording(f"{path.name} cannot be read: {e.strerror}") from e


def write_checksum(recording: Path, sha256: str) -> Path:
    """Write the checksum file durably and atomically. Raises :class:`StorageFailed`."""
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
    """Compare a recording with the checksum file beside it.

    Raises
    ------
    DamagedRecording
        The checksum differs; the error names the file, the expected and the found value.
    UnknownThing
        The recording does not exist.
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
