"""Merge the segments of a session into one recording when the session ends.

The segments are read twice: first to find the place of each message, then to copy the messages in their new order,
one chunk at a time, so that an hour of gaze needs no more memory than a minute. The recording is put in its place
atomically, and then its checksum file. A crash in between leaves a recording without a checksum, never with a
wrong one.
"""

from __future__ import annotations

from array import array
from collections import OrderedDict
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from shift_schemas.errors import Conflict, DamagedRecording, shorten
from shift_schemas.registry import OWNER_OF, OWNERS, SUBJECTS

from shift_recording.checksum import checksum_path, sha256_of, write_checksum
from shift_recording.durable_file import DurableFile, make_folder, replace, storage_errors, sync_folder
from shift_recording.mcap.reader import Recording, Report, chunk_at
from shift_recording.mcap.records import Attachment, message_at
from shift_recording.mcap.writer import SESSION_METADATA, RecordingWriter

CHUNK_BYTES = 2 * 2**20
"""Bytes of an uncompressed chunk. Large chunks compress better and have short indexes; Foxglove loads whole chunks."""
_CACHE_BYTES = 32 * 2**20
_EVERY = 1000

OnProgress = Callable[[int, int], None]
"""Called from time to time with the number of written messages and their total."""
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class FinishedRecording:
    """A finished recording.

    ``missing`` gives for each owner the first and the last sequence number, counted from 1, of each gap in all
    sources. The owner's journal may still have these messages; they can be written to another segment, and the
    recording can be merged again. ``sources`` says for each source whether it was read completely.
    """

    path: Path
    sha256: str
    counts: dict[str, int]
    bytes: int
    duplicates: int
    missing: dict[str, tuple[tuple[int, int], ...]]
    sources: tuple[Report, ...]


def finish_recording(
    session: str,
    sources: Sequence[Path],
    target: Path,
    *,
    schemas: Mapping[str, bytes],
    metadata: Mapping[str, Mapping[str, str]],
    attachments: Iterable[Attachment],
    progress: OnProgress | None = None,
) -> FinishedRecording:
    """Merge ``sources`` into the finished recording ``target``.

    A message that is there twice, by topic and sequence, is written once, as it was recorded first. Messages stay in
    the order in which they were recorded, and each owner's messages are in the order of its sequence: a message that
    was recorded late moves to before its successor. The order does not use log_time, because a clock can jump.
    A source that is cut off or damaged gives the messages before that place; see ``sources`` of the result.

    Parameters
    ----------
    sources
        An earlier finished recording, if it exists, and the segments, the oldest first.
    target
        The file to write; it may be one of the sources.
    schemas
        By subject, from :func:`shift_recording.mcap.schemas.subject_schemas`.
    metadata
        ``shift:session`` and ``shift:config``; the session's id is added to the former.

    Raises
    ------
    Conflict
        A source belongs to another session, or is not a recording of SHIFT.
    UnknownThing
        A source does not exist.
    StorageFailed
        The disk refuses the write; ``target`` is unchanged.
    DamagedRecording
        The file is not read back as it was written; ``target`` is unchanged.
    """
    index = _indexed(session, sources)
    order, missing = _order(index)
    make_folder(target.parent)
    temporary = target.with_name(f".{target.name}.partial")
    whose = {SESSION_METADATA: {**metadata.get(SESSION_METADATA, {}), "session": session}}
    try:
        file = DurableFile(temporary, new=False)
        try:
            writer = RecordingWriter(file, schemas, CHUNK_BYTES)
            _write_front(writer, {**metadata, **whose}, attachments)
            counts = _write_messages(writer, index, order, progress)
            writer.finish()
            file.sync()
        finally:
            file.close()
        _read_back(temporary, counts)
        sha256 = sha256_of(temporary)
        _put_in_place(temporary, target, sha256)
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
    return FinishedRecording(
        path=target,
        sha256=sha256,
        counts=counts,
        bytes=file.tell(),
        duplicates=len(index.sequence) - len(order),
        missing=missing,
        sources=tuple(index.reports),
    )


@dataclass
class _Index:
    """The place of each message: columns in the order of recording, 16 bytes a message."""

    sources: Sequence[Path]
    chunks: list[tuple[int, int]] = field(default_factory=list)  # source's number, offset
    reports: list[Report] = field(default_factory=list)
    topic: array[int] = field(default_factory=lambda: array("B"))
    sequence: array[int] = field(default_factory=lambda: array("I"))
    chunk: array[int] = field(default_factory=lambda: array("I"))
    position: array[int] = field(default_factory=lambda: array("I"))


_TOPIC = {subject: number for number, subject in enumerate(SUBJECTS)}
_OWNER = np.array([list(OWNERS).index(OWNER_OF[subject]) for subject in SUBJECTS])


def _indexed(session: str, sources: Sequence[Path]) -> _Index:
    index = _Index(sources)
    for number, path in enumerate(sources):
        recording = Recording(path)
        with suppress(DamagedRecording):  # the report says so
            _index_source(index, number, recording)
        _check_whose(session, recording)
        index.reports.append(recording.report)
    return index


def _check_whose(session: str, recording: Recording) -> None:
    whose = recording.metadata.get(SESSION_METADATA, {}).get("session", session)
    if whose != session:
        raise Conflict(f"{recording.path.name} belongs to session {shorten(whose)!r}, not to {session!r}")
    if foreign := [topic for topic in recording.topics if topic not in _TOPIC]:
        raise Conflict(f"{recording.path.name} has the topic {shorten(foreign[0])!r}, which is none of ours")


def _index_source(index: _Index, number: int, recording: Recording) -> None:
    last = -1
    for chunk, position, message in recording.located(SUBJECTS):
        if chunk != last:
            index.chunks.append((number, chunk))
            last = chunk
        index.topic.append(_TOPIC[message.topic])
        index.sequence.append(message.sequence)
        index.chunk.append(len(index.chunks) - 1)
        index.position.append(position)


def _order(index: _Index) -> tuple[Ints, dict[str, tuple[tuple[int, int], ...]]]:
    """Return the numbers of the messages to write, in their new order, and the gaps of each owner."""
    topic = np.array(index.topic, dtype=np.int64)
    sequence = np.array(index.sequence, dtype=np.int64)
    runs, missing = [], {}
    for number, owner in enumerate(OWNERS):
        mine = np.flatnonzero(_OWNER[topic] == number)
        mine = mine[np.lexsort((mine, topic[mine], sequence[mine]))]
        twice = (np.diff(sequence[mine]) == 0) & (np.diff(topic[mine]) == 0)
        run = mine[np.concatenate(([True], ~twice))] if len(mine) else mine
        runs.append(run)
        if gaps := _gaps(sequence[run]):
            missing[owner] = gaps
    # A message that was recorded late is placed as early as the earliest of its successors.
    places = [np.minimum.accumulate(run[::-1])[::-1] for run in runs]
    return np.concatenate(runs)[np.argsort(np.concatenate(places), kind="stable")], missing


def _gaps(sequence: Ints) -> tuple[tuple[int, int], ...]:
    """Return the numbers missing from 1, 2, 3 ... in a sorted column, as the first and the last of each gap."""
    before = np.concatenate(([0], sequence))
    at = np.flatnonzero(np.diff(before) > 1)
    return tuple((int(before[i]) + 1, int(before[i + 1]) - 1) for i in at)


def _write_front(
    writer: RecordingWriter, metadata: Mapping[str, Mapping[str, str]], attachments: Iterable[Attachment]
) -> None:
    """Write metadata and attachments before the messages, so that a file that is cut off has them too."""
    for name, values in metadata.items():
        writer.metadata(name, values)
    for attachment in attachments:
        writer.attachment(attachment)


def _write_messages(writer: RecordingWriter, index: _Index, order: Ints, progress: OnProgress | None) -> dict[str, int]:
    chunks = _Chunks(index)
    counts: dict[str, int] = {}
    for start in range(0, len(order), _EVERY):
        for i in order[start : start + _EVERY].tolist():
            message = message_at(chunks.content(index.chunk[i]), index.position[i])
            subject = SUBJECTS[index.topic[i]]
            writer.message(subject, *message[1:])
            counts[subject] = counts.get(subject, 0) + 1
        if progress is not None:
            progress(min(start + _EVERY, len(order)), len(order))
    return counts


class _Chunks:
    """Unpacked chunks of the sources; the chunks used last are kept, up to ``_CACHE_BYTES``."""

    def __init__(self, index: _Index) -> None:
        self._index = index
        self._kept: OrderedDict[int, bytes] = OrderedDict()
        self._bytes = 0

    def content(self, number: int) -> bytes:
        """Return the chunk of that number."""
        found = self._kept.get(number)
        if found is not None:
            self._kept.move_to_end(number)
            return found
        source, offset = self._index.chunks[number]
        content = chunk_at(self._index.sources[source], offset)
        self._bytes += len(content)
        while self._kept and self._bytes > _CACHE_BYTES:
            self._bytes -= len(self._kept.popitem(last=False)[1])
        self._kept[number] = content
        return content


def _read_back(path: Path, counts: Mapping[str, int]) -> None:
    """Read the written file. Raise :class:`DamagedRecording` unless it is whole and has as many messages as written."""
    recording, found = Recording(path), dict.fromkeys(counts, 0)
    for message in recording.messages():
        found[message.topic] += 1
    if not recording.report.complete or found != counts:
        why = recording.report.reason or f"it has {sum(found.values())} messages instead of {sum(counts.values())}"
        raise DamagedRecording(f"the recording was not written as it should be, and is kept in its segments: {why}")


def _put_in_place(temporary: Path, target: Path, sha256: str) -> None:
    """Put the recording in its place, so that a checksum file never stands beside another recording than its own."""
    with storage_errors(target):
        checksum_path(target).unlink(missing_ok=True)
    sync_folder(target.parent)
    replace(temporary, target)
    write_checksum(target, sha256)
