"""Segments: what the recorder appends to while a session lives, one file per life of the recorder.

``{folder}/{session}/0001.mcap``, ``0002.mcap``, ... After a crash the next one begins, and
``finishing`` makes one recording of them. A message is safe when :meth:`SegmentWriter.flush` has
returned: mcap holds a chunk in memory until it is full, and its own flush does not fsync.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping
from pathlib import Path

from shift_schemas.errors import MalformedMessage
from shift_schemas.ids import is_id, not_an_id

from shift_recording.durable_file import DurableFile, StorageFailed, make_folder, sync_folder
from shift_recording.mcap.writer import SESSION_METADATA, RecordingWriter

CHUNK_BYTES = 2**20
"""A chunk ends here at the latest; with a flush each second it ends long before."""


def segments_of(folder: Path, session: str) -> list[Path]:
    """The session's segments, oldest first. Raises :class:`MalformedMessage` for what is no id."""
    found = _session_folder(folder, session).glob("*.mcap")
    return sorted((f for f in found if f.stem.isdecimal()), key=lambda f: int(f.stem))


class SegmentWriter:
    """A new segment of a session. Not for several threads at once.

    Once the disk has refused, the segment ends at its last flush and every call raises: what was
    written since must be written again, to a new segment (``finishing`` drops what is there twice).

    Raises
    ------
    StorageFailed
        From every method: disk full, read-only, over a limit.
    """

    def __init__(self, folder: Path, session: str, schemas: Mapping[str, bytes]) -> None:
        """Makes the file, which says whose it is, durably."""
        parent = _session_folder(folder, session)
        make_folder(parent)
        self._file = _next_file(parent, segments_of(folder, session))
        self._pending = 0
        self._refused: StorageFailed | None = None
        with self._refusals():
            self._writer = RecordingWriter(self._file, schemas, CHUNK_BYTES)
            self._writer.metadata(SESSION_METADATA, {"session": session})
            self._file.sync()
            sync_folder(parent)

    @property
    def path(self) -> Path:
        """The segment's file."""
        return self._file.path

    def write(self, subject: str, sequence: int, log_time: int, publish_time: int, payload: bytes) -> None:
        """Adds a message: its owner's sequence, when it was recorded and its stamp, both ns.

        Raises also what ``RecordingWriter.message`` raises; the segment goes on without that message.
        """
        with self._refusals():
            self._writer.message(subject, sequence, log_time, publish_time, payload)
            self._pending += 1

    def flush(self) -> int:
        """Returns when every message is on the disk; how many of them were not before."""
        with self._refusals():
            self._writer.close_chunk()
            self._file.sync()
        flushed, self._pending = self._pending, 0
        return flushed

    def finish(self) -> None:
        """Makes it a whole file, with index and footer, and closes it."""
        with self._refusals():
            self._writer.finish()
            self._file.sync()
            self._file.close()

    def abandon(self) -> None:
        """Closes it as it is: all that was flushed can be read."""
        self._file.close()

    @contextlib.contextmanager
    def _refusals(self) -> Iterator[None]:
        if self._refused is not None:
            raise StorageFailed(self._refused.detail) from self._refused
        try:
            yield
        except StorageFailed as e:
            self._refused = e
            self._file.cut_back()
            with contextlib.suppress(StorageFailed):
                self._file.close()
            raise


def _session_folder(folder: Path, session: str) -> Path:
    if not is_id(session):
        raise MalformedMessage(not_an_id(session))
    return folder / session


def _next_file(parent: Path, segments: list[Path]) -> DurableFile:
    number = int(segments[-1].stem) + 1 if segments else 1
    while True:
        try:
            return DurableFile(parent / f"{number:04}.mcap", new=True)
        except FileExistsError:
            number += 1
