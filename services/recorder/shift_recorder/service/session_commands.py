"""What the recorder adds to a command that starts a session: its study, its software, and room for its recording."""

from __future__ import annotations

import os
import shutil
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from shift_runtime.study_files import study_to_start
from shift_schemas.errors import MalformedMessage, Unavailable
from shift_schemas.messages import Message, StartSession
from shift_schemas.shards import Shard, shard_of

LEAST_FREE_BYTES = 64 * 2**20
"""The free space without which no session starts, bytes: an hour of gaze at 300 Hz and its journals. A choice."""


@lru_cache(maxsize=1)
def software() -> tuple[str, str]:
    """Return the version of shift-mesh, and the git revision where it is known (``SHIFT_REVISION``)."""
    try:
        return version("shift-mesh"), os.environ.get("SHIFT_REVISION", "")
    except PackageNotFoundError:
        return "0", os.environ.get("SHIFT_REVISION", "")


class SessionCommands:
    """Prepares the recorder's commands for its core.

    Parameters
    ----------
    data
        The data folder, with ``recordings``, ``segments`` and ``studies`` in it.
    shard
        The shard of this worker; sessions of other shards are refused.
    """

    def __init__(self, data: Path, shard: Shard = Shard()) -> None:  # noqa: B008 (it is frozen)
        self._shard = shard
        self._recordings = data / "recordings"
        self._segments = data / "segments"
        self._studies = data / "studies"

    def prepare(self, session: str, message: Message) -> Any:
        """Return the message; a start gets its study, its software and its warnings.

        Raises
        ------
        Unavailable
            There is no room for the recording, or its folder cannot be written.
        InvalidStudy
            The study does not exist or is not valid.
        MalformedMessage
            The session belongs to another shard.
        """
        if not isinstance(message, StartSession):
            return message
        if not self._shard.holds(session):
            belongs = Shard(shard_of(session, self._shard.count), self._shard.count)
            raise MalformedMessage(
                f"session {session} belongs to shard {belongs}, and this is shard {self._shard}: the client must send "
                "each session to the shard to which its id hashes (shift_schemas.shards.shard_of)"
            )
        self._check_room()
        study, warnings = study_to_start(message.study, self._studies)
        known, revision = software()
        shard = str(self._shard) if self._shard.count > 1 else ""
        found = {
            "study": study, "software": known, "revision": revision, "shard": shard, "warnings": list(warnings),
        }  # fmt: skip
        return message.model_copy(update=found)

    def _check_room(self) -> None:
        try:
            self._segments.mkdir(parents=True, exist_ok=True)
            self._recordings.mkdir(parents=True, exist_ok=True)
            free = shutil.disk_usage(self._recordings).free
        except OSError as e:
            raise Unavailable(f"the recorder cannot write to {self._recordings}: {e.strerror}") from e
        if not os.access(self._segments, os.W_OK) or not os.access(self._recordings, os.W_OK):
            raise Unavailable(f"the recorder must not write to {self._recordings}: the folder is read-only")
        if free < LEAST_FREE_BYTES:
            raise Unavailable(f"{self._recordings} has {free // 2**20} MB left; no session starts below 64 MB")
