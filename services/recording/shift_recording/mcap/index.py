"""Read a few messages of a large recording through its index, without reading the rest.

Only a recording whose SHA-256 matches is read in this way: then every byte is as it was written, read back and
acknowledged, and the checks of the streaming reader (``shift_recording.mcap.reader``) would find nothing.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from itertools import chain
from pathlib import Path
from typing import Any

from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.summary import Summary
from shift_schemas.errors import DamagedRecording

from shift_recording.checksum import Checksum, check
from shift_recording.mcap import records as p
from shift_recording.mcap.reader import RecordedFact, RecordedMessage, Recording, chunk_at, recorded_fact


class Index:
    """The summary section of a finished recording: its counts, and where the messages of each topic are."""

    def __init__(self, path: Path, summary: Summary) -> None:
        self._path, self._summary = path, summary

    @property
    def counts(self) -> dict[str, int]:
        """The number of messages of each topic that has any."""
        statistics: Any = self._summary.statistics
        channels = self._summary.channels
        return {channels[n].topic: count for n, count in statistics.channel_message_counts.items() if count}

    @property
    def library(self) -> str:
        """The program that wrote the file, such as ``shift-mesh/0.3.0``."""
        with open(self._path, "rb") as stream:
            return make_reader(stream).get_header().library

    @property
    def attachments(self) -> dict[str, int]:
        """The size of each attachment, bytes."""
        return {a.name: a.data_size for a in self._summary.attachment_indexes}

    def metadata(self) -> dict[str, dict[str, str]]:
        """Return the metadata by name."""
        with open(self._path, "rb") as stream:
            return {record.name: record.metadata for record in make_reader(stream).iter_metadata()}

    def messages(self, topics: Collection[str]) -> Iterator[RecordedMessage]:
        """Yield the messages of ``topics`` in the file's order; only they are unpacked into objects."""
        channels = {n: channel.topic for n, channel in self._summary.channels.items() if channel.topic in topics}
        for chunk in sorted(self._summary.chunk_indexes, key=lambda chunk: chunk.chunk_start_offset):
            indexes = [offset for n, offset in chunk.message_index_offsets.items() if n in channels]
            if not indexes:
                continue
            content = chunk_at(self._path, chunk.chunk_start_offset)
            for position in sorted(chain.from_iterable(map(self._positions, indexes))):
                message = p.message_at(content, position)
                yield RecordedMessage(channels[message.channel_id], *message[1:])

    def _positions(self, offset: int) -> list[int]:
        """Return where the messages of one channel are in their unpacked chunk."""
        with open(self._path, "rb") as stream:
            stream.seek(offset)
            _, length = p.HEAD.unpack(stream.read(p.HEAD.size))
            return p.message_index_of(memoryview(stream.read(length)))


def index_of(path: Path) -> Index | None:
    """Return the index of a finished recording; None if its checksum is missing or differs, or it has no summary.

    Raises
    ------
    UnknownThing
        The file does not exist.
    """
    try:
        if check(path) is not Checksum.MATCHES:
            return None
        with open(path, "rb") as stream:
            summary = make_reader(stream).get_summary()
    except (DamagedRecording, McapError, OSError, ValueError):
        return None
    return Index(path, summary) if summary is not None and summary.statistics is not None else None


def facts_about(path: Path, topics: Collection[str]) -> Iterator[RecordedFact]:
    """Yield the facts of a few topics: through the index where the recording has one, else by reading all of it.

    Raises
    ------
    DamagedRecording, UnknownThing
        As :meth:`~shift_recording.mcap.reader.Recording.facts`.
    """
    index = index_of(path)
    messages = index.messages(topics) if index is not None else Recording(path).messages(topics)
    for message in messages:
        yield recorded_fact(path, message)
