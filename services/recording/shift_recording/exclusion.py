"""The exclusion of a recording from analysis, in ``NAME.mcap.exclusion.json`` beside the file.

The recording itself never changes. The file holds every exclusion and every return with author, reason and time; the
last entry holds. So a return does not hide that there was an exclusion.
"""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, ValidationError
from shift_schemas.errors import DamagedRecording, UnknownThing
from shift_schemas.timestamps import Stamp

from shift_recording.durable_file import write_durably

EXCLUSION_FORMAT = 1
"""The format of the file that this version writes."""
_LOCK = threading.Lock()
"""Two pages of one gateway may write at the same time; nobody else writes."""


class ExclusionEntry(BaseModel):
    """One change: the recording is excluded, or it is included again."""

    model_config = ConfigDict(frozen=True, extra="ignore", str_strip_whitespace=True)

    excluded: bool
    reason: Annotated[str, Field(max_length=1000)]
    author: Annotated[str, Field(min_length=1, max_length=100)]
    time: Stamp


class Exclusion(BaseModel):
    """The whole file: every change, the oldest first."""

    model_config = ConfigDict(frozen=True, extra="ignore")

    format: Annotated[int, Field(ge=1, le=EXCLUSION_FORMAT)] = EXCLUSION_FORMAT
    recording: str
    entries: tuple[ExclusionEntry, ...] = ()

    @property
    def in_force(self) -> ExclusionEntry | None:
        """The exclusion that holds; None if the recording is not excluded."""
        return self.entries[-1] if self.entries and self.entries[-1].excluded else None


def exclusion_path(recording: Path) -> Path:
    """Return the path of the file beside a recording."""
    return recording.with_name(f"{recording.name}.exclusion.json")


def read_exclusion(recording: Path) -> Exclusion:
    """Return the exclusions of a recording; without a file the list is empty.

    Raises
    ------
    DamagedRecording
        The file cannot be read, or a later version of shift-mesh wrote it.
    """
    path = exclusion_path(recording)
    try:
        return Exclusion.model_validate_json(path.read_bytes())
    except FileNotFoundError:
        return Exclusion(recording=recording.name)
    except OSError as e:
        raise DamagedRecording(f"{path.name} cannot be read: {e.strerror}") from e
    except ValidationError as e:
        first = e.errors()[0]
        where = ".".join(str(part) for part in first["loc"]) or "the file"
        raise DamagedRecording(f"{path.name}: {where}: {first['msg']}") from e


def add_entry(recording: Path, entry: ExclusionEntry) -> Exclusion:
    """Append a change durably, and return all of them.

    Raises
    ------
    UnknownThing
        The recording does not exist.
    DamagedRecording
        The present file cannot be read; it is not overwritten.
    StorageFailed
        The disk refuses the write.
    """
    if not recording.is_file():
        raise UnknownThing(f"there is no recording {recording.name}")
    with _LOCK:
        before = read_exclusion(recording)
        after = before.model_copy(update={"entries": (*before.entries, entry)})
        write_durably(exclusion_path(recording), after.model_dump_json(indent=2).encode() + b"\n")
    return after
