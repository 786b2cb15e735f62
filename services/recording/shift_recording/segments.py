"""Segments: the files to which the recorder appends while a session is live, one for each run of the recorder.

The files are ``{folder}/{session}/0001.mcap``, ``0002.mcap``, ... After a crash the next one begins, and ``merging``
makes one recording of them. A message is durable when :meth:`SegmentWriter.flush` has returned. The flush of the mcap
library does not suffice: the library keeps a chunk in memory until it is full, and does not call fsync.
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
"""The largest size of a chunk, bytes; a flush each second usually ends it earlier."""


def segments_of(folder: Path, session: str) -> list[Path]:
    """Return the session's segments, the oldest first. Raises :class:`MalformedMessage` if ``session`` is not an id."""
    found = _session_folder(folder, session).glob("*.mcap")
    return sorted((f for f in found if f.stem.isdecimal()), key=lambda f: int(f.stem))


class SegmentWriter:
    """A new segment of a session. Use it from one thread at a time.

    After the disk has refused a write, the segment ends at its last flush and every call raises. Messages written since
    then must be written again to a new segment; ``merging`` drops messages that are there twice.

    Raises
    ------
    StorageFailed
        From every method: the disk is full, read-only or over a limit.
    """

    def __init__(self, folder: Path, session: str, schemas: Mapping[str, bytes]) -> None:
        """Make the file durably; its metadata names the session."""
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
        """Add a message: its owner's sequence number, the time of recording and its stamp, both in ns.

        Raises also what ``RecordingWriter.message`` raises; the segment continues without that message.
        """
        with self._refusals():
            self._writer.message(subject, sequence, log_time, publish_time, payload)
            self._pending += 1

    def flush(self) -> int:
        """Sync every message to the disk, and return how many were not synced before."""
        with self._refusals():
            self._writer.close_chunk()
            self._file.sync()
        flushed, self._pending = self._pending, 0
        return flushed

    def finish(self) -> None:
        """Write the index and the footer, and close the file."""
        with self._refusals():
            self._writer.finish()
            self._file.sync()
            self._file.close()

    def abandon(self) -> None:
        """Close the file as it is; everything that was flushed can be read."""
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
