"""Recover and convert MCAP files of any program: what can be read is written to a new, whole file.

A file is read twice: first for its schemas and channels, wherever they stand, then for its messages. A chunk that is
damaged is skipped and reported; the others are kept. Memory is bounded by one chunk. Every checksum is checked, and
written anew.
"""

from __future__ import annotations

import heapq
import os
import pickle
import struct
from collections.abc import Collection, Iterable, Iterator
from contextlib import ExitStack, closing
from dataclasses import asdict, dataclass, field
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, Any

from mcap.writer import CompressionType, Writer
from shift_schemas.errors import Conflict, DamagedRecording, UnknownThing
from shift_schemas.timestamps import NS

from shift_recording.checksum import sha256_of, write_checksum
from shift_recording.durable_file import DurableFile, make_folder, replace
from shift_recording.mcap import records as p
from shift_recording.mcap.writer import library

CHUNK_BYTES = 2**20
MOST_PROBLEMS = 20
"""So many problems of a file are named; the others are counted in the lost bytes alone."""


SORTED_BYTES = 32 * 2**20
"""So many bytes of messages are sorted in memory at once; chosen, as the reader's bound is 256 MB."""
MESSAGE_OVERHEAD = 300
"""What a message costs in memory beside its data, bytes."""


@dataclass(frozen=True)
class Wanted:
    """The messages to keep. Times are seconds from the first message's log time; None is no limit."""

    topics: Collection[str] | None = None
    start_s: float | None = None
    end_s: float | None = None
    sorted: bool = False
    """Whether the messages are written in the order of their log times."""

    def keeps(self, topic: str, log_time: int, first: int) -> bool:
        """Return whether a message is kept; ``first`` is the log time of the first message, ns."""
        at_s = (log_time - first) / NS
        return (
            (self.topics is None or topic in self.topics)
            and (self.start_s is None or at_s >= self.start_s)
            and (self.end_s is None or at_s <= self.end_s)
        )


@dataclass
class Recovered:
    """What was read of one file.

    ``complete`` says whether the whole file could be read, up to its footer. ``lost_bytes`` are those of damaged
    records and of everything after the place where reading had to stop.
    """

    name: str
    complete: bool = False
    messages: int = 0
    lost_bytes: int = 0
    written: str = ""
    problems: list[str] = field(default_factory=list)

    def as_json(self) -> dict[str, Any]:
        """Return what ``--json`` prints."""
        return asdict(self)

    def lose(self, bytes_: int, why: str) -> None:
        """Note a loss."""
        self.lost_bytes += bytes_
        if len(self.problems) < MOST_PROBLEMS:
            self.problems.append(why)


@dataclass(frozen=True)
class _Channel:
    record: p.ChannelRecord
    metadata: dict[str, str]


class _Source:
    """One file to read."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.result = Recovered(path.name)
        self.profile = ""
        self.schemas: dict[int, p.SchemaRecord] = {}
        self.channels: dict[int, _Channel] = {}
        self.metadata: list[tuple[str, dict[str, str]]] = []
        self.attachments: list[p.Attachment] = []
        self.first: int | None = None
        """The smallest log time, ns."""
        self._held = 0
        for opcode, at, body in self._records(report=True):
            if opcode in (p.CHUNK, p.MESSAGE) or self._has_room(len(body), at):
                self._note(opcode, body)

    def messages(self) -> Iterator[tuple[int, int, p.MessageRecord]]:
        """Yield log time, the message's number in the file, and the message, in the file's order."""
        number = 0
        for opcode, _, body in self._records(report=False):
            for message in self._messages_of(opcode, body):
                if message.channel_id in self.channels:
                    number += 1
                    yield message.log_time, number, message
                else:
                    self.result.lose(len(message.data), f"channel {message.channel_id} of a message is not in the file")

    def _messages_of(self, opcode: int, body: memoryview) -> Iterator[p.MessageRecord]:
        if opcode == p.MESSAGE:
            yield p.message_of(body)
        elif opcode == p.CHUNK:
            for kind, _, record in p.records_in(p.chunk_content(body)):
                if kind == p.MESSAGE:
                    yield p.message_of(record)

    def _records(self, report: bool) -> Iterator[tuple[int, int, memoryview]]:
        """Yield kind, offset and body of every record that can be read. Damage is noted if ``report`` is set."""
        size = self.path.stat().st_size
        with open(self.path, "rb") as stream:
            if stream.read(len(p.MAGIC)) != p.MAGIC:
                self._stop(report, 0, size, "this is not an MCAP file")
                return
            at = len(p.MAGIC)
            while at < size:
                head = stream.read(p.HEAD.size)
                if head[: len(p.MAGIC)] == p.MAGIC[: len(head)] and size - at <= len(p.MAGIC):
                    return
                if len(head) < p.HEAD.size:
                    return self._stop(report, at, size, "the file ends within a record")
                opcode, length = p.HEAD.unpack(head)
                if not 0 < opcode < 0x80 or length > size - at - p.HEAD.size:
                    return self._stop(report, at, size, f"at byte {at}: what follows is not a record, or is cut off")
                if length > p.MAXIMUM_BYTES:
                    stream.seek(length, os.SEEK_CUR)
                    self._lose(report, length, f"at byte {at}: a record of {length} bytes is larger than is read")
                else:
                    body = memoryview(stream.read(length))
                    if self._is_good(opcode, body, at, report):
                        yield opcode, at, body
                    if opcode == p.FOOTER and report:
                        self.result.complete = not self.result.lost_bytes
                at += p.HEAD.size + length

    def _is_good(self, opcode: int, body: memoryview, at: int, report: bool) -> bool:
        try:
            match opcode:
                case p.CHUNK:
                    for kind, _, record in p.records_in(p.chunk_content(body)):
                        _parse(kind, record)
                case _:
                    _parse(opcode, body)
        except (DamagedRecording, struct.error, UnicodeDecodeError) as e:
            why = e.detail if isinstance(e, DamagedRecording) else str(e)
            self._lose(report, p.HEAD.size + len(body), f"at byte {at}: {why}")
            return False
        return True

    def _note(self, opcode: int, body: memoryview) -> None:
        if opcode == p.CHUNK:
            for kind, _, record in p.records_in(p.chunk_content(body)):
                self._note(kind, record)
            return
        match opcode:
            case p.HEADER:
                self.profile = p.header_of(body)[0]
            case p.SCHEMA:
                schema = p.schema_of(body)
                self.schemas.setdefault(schema.id, schema)
            case p.CHANNEL:
                channel = p.channel_of(body)
                self.channels.setdefault(channel.id, _Channel(channel, _channel_metadata(body)))
            case p.MESSAGE:
                log_time = p.message_of(body).log_time
                self.first = log_time if self.first is None else min(self.first, log_time)
            case p.METADATA:
                self.metadata.append(p.metadata_of(body))
            case p.ATTACHMENT:
                self.attachments.append(p.attachment_of(body))

    def _has_room(self, length: int, at: int) -> bool:
        """Return whether another record besides messages can be kept in memory."""
        self._held += length
        if self._held <= p.MAXIMUM_BYTES:
            return True
        self.result.lose(length, f"at byte {at}: schemas, channels, metadata and attachments need too much memory")
        return False

    def _lose(self, report: bool, bytes_: int, why: str) -> None:
        if report:
            self.result.lose(bytes_, why)

    def _stop(self, report: bool, at: int, size: int, why: str) -> None:
        self._lose(report, size - at, why)


def _parse(opcode: int, body: memoryview) -> None:
    """Raise an error unless the record is one of its kind. Kinds that are not kept are not looked into."""
    parsers: dict[int, Any] = {
        p.SCHEMA: p.schema_of, p.CHANNEL: p.channel_of, p.MESSAGE: p.message_of, p.METADATA: p.metadata_of,
        p.ATTACHMENT: p.attachment_of, p.HEADER: p.header_of,
    }  # fmt: skip
    if opcode in parsers:
        parsers[opcode](body)


def _channel_metadata(body: memoryview) -> dict[str, str]:
    c = p.Cursor(body, "channel")
    c.number(2), c.number(2), c.text(), c.text()
    return c.mapping()


class _Target:
    """The new file. Equal schemas and channels of several sources are written once."""

    def __init__(self, file: DurableFile, profile: str, folder: Path) -> None:
        self.folder = folder
        """Where temporary files may be made."""
        self._writer: Any = Writer(
            file,  # type: ignore[arg-type]  # it uses write, tell and flush only
            chunk_size=CHUNK_BYTES,
            compression=CompressionType.ZSTD,
            enable_crcs=True,
            enable_data_crcs=True,
        )
        self._writer.start(profile=profile, library=library())
        self._schemas: dict[tuple[str, str, bytes], int] = {}
        self._channels: dict[tuple[Any, ...], int] = {}

    def front(self, source: _Source) -> None:
        """Write the metadata and the attachments of a source."""
        for name, values in source.metadata:
            self._writer.add_metadata(name, values)
        for a in source.attachments:
            self._writer.add_attachment(a.log_time, a.log_time, a.name, a.media_type, a.data)

    def message(self, source: _Source, m: p.MessageRecord) -> None:
        """Write a message."""
        self._writer.add_message(
            self._channel(source, m.channel_id), log_time=m.log_time, data=m.data, publish_time=m.publish_time,
            sequence=m.sequence,
        )  # fmt: skip

    def finish(self) -> None:
        """Write the indexes and the footer."""
        self._writer.finish()

    def _channel(self, source: _Source, number: int) -> int:
        channel = source.channels[number]
        record, schema = channel.record, source.schemas.get(channel.record.schema_id)
        key = (record.topic, record.encoding, schema and (schema.name, schema.encoding, schema.data),
               tuple(sorted(channel.metadata.items())))  # fmt: skip
        if key not in self._channels:
            schema_id = self._schema(schema) if schema is not None else 0
            self._channels[key] = self._writer.register_channel(
                record.topic, record.encoding, schema_id, channel.metadata
            )
        return self._channels[key]

    def _schema(self, schema: p.SchemaRecord) -> int:
        key = (schema.name, schema.encoding, schema.data)
        if key not in self._schemas:
            self._schemas[key] = self._writer.register_schema(*key)
        return self._schemas[key]


def recover(paths: Iterable[Path], target: Path, wanted: Wanted = Wanted()) -> list[Recovered]:
    """Write what can be read of one or several files to ``target``, which appears when it is whole.

    The messages of one file stay in their order unless they are to be sorted; those of several files are merged by
    their log time.

    Raises
    ------
    UnknownThing
        A file does not exist.
    Conflict
        ``target`` is one of the files, or exists already.
    StorageFailed
        The disk refuses a write.
    """
    paths = tuple(paths)
    for path in paths:
        if not path.is_file():
            raise UnknownThing(f"there is no file {path}")
    if target.exists():
        raise Conflict(f"{target} exists already; name another file or folder with --out")
    sources = [_Source(path) for path in paths]
    make_folder(target.parent)
    part = target.with_name(f".{target.name}.part")
    part.unlink(missing_ok=True)
    with closing(DurableFile(part, new=True)) as file:
        written = _Target(file, sources[0].profile, target.parent)
        for source in sources:
            written.front(source)
        _copy(sources, written, wanted)
        written.finish()
        file.sync()
    replace(part, target)
    write_checksum(target, sha256_of(target))
    for source in sources:
        source.result.written = str(target)
    return [source.result for source in sources]


def _copy(sources: list[_Source], target: _Target, wanted: Wanted) -> None:
    first = min((source.first for source in sources if source.first is not None), default=0)
    each = [_numbered(i, source) for i, source in enumerate(sources)]
    if wanted.sorted:
        each = [_sorted(messages, target.folder) for messages in each]
    merged = heapq.merge(*each) if len(each) > 1 else each[0]
    for _, i, _, message in merged:
        source = sources[i]
        if wanted.keeps(source.channels[message.channel_id].record.topic, message.log_time, first):
            target.message(source, message)
            source.result.messages += 1


_Numbered = tuple[int, int, int, p.MessageRecord]
"""The log time, the number of the source, the number within it, and the message."""


def _sorted(messages: Iterator[_Numbered], folder: Path) -> Iterator[_Numbered]:
    """Yield the messages by their own log time. Sorted parts of :data:`SORTED_BYTES` are kept in temporary files."""
    with ExitStack() as files:
        parts, part, held = list[Iterator[_Numbered]](), list[_Numbered](), 0
        for _, i, number, message in messages:
            part.append((message.log_time, i, number, message))
            held += len(message.data) + MESSAGE_OVERHEAD
            if held >= SORTED_BYTES:
                parts.append(_stored(sorted(part), files.enter_context(TemporaryFile(dir=folder))))
                part, held = [], 0
        yield from heapq.merge(*parts, iter(sorted(part)))


def _stored(part: list[_Numbered], file: IO[bytes]) -> Iterator[_Numbered]:
    """Write a sorted part to a file, and return an iterator that reads it again."""
    for each in part:
        pickle.dump(each, file, pickle.HIGHEST_PROTOCOL)
    file.seek(0)
    return (pickle.load(file) for _ in range(len(part)))


def _numbered(i: int, source: _Source) -> Iterator[tuple[int, int, int, p.MessageRecord]]:
    """Yield a source's messages with its number. A log time that goes back counts as the one before it."""
    latest = 0
    for log_time, number, message in source.messages():
        latest = max(latest, log_time)
        yield latest, i, number, message
