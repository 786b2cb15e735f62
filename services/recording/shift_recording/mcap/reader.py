"""Read recordings that are finished, unfinished, cut off at any byte, or damaged.

The reader makes one streaming pass and checks every checksum. If a file ends too early, the messages before its end
are valid, and :attr:`Recording.report` says that it is incomplete. If a file contradicts itself, the reader raises
:class:`DamagedRecording` at that position, after valid messages. It raises nothing else, and its memory is bounded
for any content (docs/reliability.md).
"""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import NoneType
from typing import NamedTuple, get_args

from shift_schemas.codec import decode
from shift_schemas.errors import DamagedRecording, MalformedMessage, UnknownThing, shorten
from shift_schemas.messages import Fact
from shift_schemas.registry import FACTS

from shift_recording.mcap import records as p
from shift_recording.mcap.scanner import CutOff, Scan

MAXIMUM_HELD = 4 * 2**20
"""Bytes of schemas, channels and metadata of one file that a reader keeps."""


class RecordedMessage(NamedTuple):
    """A recorded message. Times are in ns since the epoch; ``sequence`` is the owner's number modulo 2^32."""

    topic: str
    sequence: int
    log_time: int
    publish_time: int
    data: bytes


class RecordedFact(NamedTuple):
    """A recorded fact, its owner's sequence number and the time when it was recorded, ns since the epoch."""

    sequence: int
    log_time: int
    fact: Fact


class Located(NamedTuple):
    """A message and its place: the offset of its chunk in the file, and its position in the unpacked chunk."""

    chunk: int
    position: int
    message: RecordedMessage


@dataclass(frozen=True)
class Report:
    """How far a file could be read, and why reading stopped there."""

    complete: bool
    damaged: bool = False
    reason: str = "it has not been read to its end"
    messages: int = 0
    bytes: int = 0


class Recording:
    """A recording file. Its schemas, metadata and attachments are known as far as it has been read.

    Attributes
    ----------
    schemas : dict[str, bytes]
        By topic.
    metadata : dict[str, dict[str, str]]
        By name; the metadata stands before the messages.
    attachments : dict[str, Attachment]
        By name; the attachments stand before the messages.
    report : Report
        After a pass: whether the file is complete.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._clear()

    def _clear(self) -> None:
        self.library = ""
        self.schemas: dict[str, bytes] = {}
        self.metadata: dict[str, dict[str, str]] = {}
        self.attachments: dict[str, p.Attachment] = {}
        self.report = Report(complete=False)
        self._schemas: dict[int, p.SchemaRecord] = {}
        self._channels: dict[int, p.ChannelRecord] = {}
        self._held = self._attached = self._count = 0

    @property
    def topics(self) -> tuple[str, ...]:
        """The topics that the file declares, including topics without messages."""
        return tuple(dict.fromkeys(channel.topic for channel in self._channels.values()))

    def messages(self, topics: Collection[str] | None = None) -> Iterator[RecordedMessage]:
        """Yield the messages in the file's order: all of them, or those of ``topics``. Each call is a new pass.

        Raises
        ------
        DamagedRecording
            The file contradicts itself; the messages before this position are valid.
        UnknownThing
            The file does not exist.
        """
        return (located.message for located in self.located(topics))

    def facts(self, topics: Collection[str] | None = None) -> Iterator[RecordedFact]:
        """Yield the messages as facts. Raises as :meth:`messages` does, and for a payload that is not a valid fact."""
        for message in self.messages(topics):
            yield recorded_fact(self.path, message)

    def located(self, topics: Collection[str] | None = None) -> Iterator[Located]:
        """Yield the messages as :meth:`messages` does, each with its place."""
        self._clear()
        scan: Scan | None = None
        try:
            with open(self.path, "rb") as stream:
                scan = Scan(stream)
                for offset, opcode, body in scan.records():
                    if opcode == p.CHUNK:
                        yield from self._chunk(offset, body, topics)
                    elif not scan.in_summary:
                        self._take_in(opcode, body)
            self.report = Report(True, reason="", messages=self._count, bytes=scan.good)
        except CutOff:
            good = scan.good if scan else 0
            reason = f"it was not finished: it ends before its footer, {good} bytes of it can be read"
            self.report = Report(False, reason=reason, messages=self._count, bytes=good)
        except FileNotFoundError as e:
            raise UnknownThing(f"there is no recording {self.path.name}") from e
        except (DamagedRecording, OSError) as e:
            raise self._damaged(e, scan.good if scan else 0) from e

    def _damaged(self, e: DamagedRecording | OSError, good: int) -> DamagedRecording:
        why = e.detail if isinstance(e, DamagedRecording) else f"it cannot be read: {e.strerror}"
        self.report = Report(False, damaged=True, reason=why, messages=self._count, bytes=good)
        return DamagedRecording(f"{self.path.name}: after {good} bytes: {why}")

    def _chunk(self, offset: int, body: memoryview, topics: Collection[str] | None) -> Iterator[Located]:
        for opcode, position, record in p.records_in(p.chunk_content(body)):
            if opcode == p.MESSAGE:
                m = p.message_of(record)
                channel = self._channels.get(m.channel_id)
                if channel is None:
                    raise DamagedRecording(f"a message is of channel {m.channel_id}, which there is not")
                self._count += 1
                if topics is None or channel.topic in topics:
                    yield Located(offset, position, RecordedMessage(channel.topic, *m[1:]))
            elif opcode in (p.SCHEMA, p.CHANNEL):
                self._take_in(opcode, record)
            else:
                raise DamagedRecording(f"a record of kind {opcode} cannot stand in a chunk")

    def _take_in(self, opcode: int, body: memoryview) -> None:
        match opcode:
            case p.HEADER:
                _, self.library = p.header_of(body)
            case p.SCHEMA:
                schema = p.schema_of(body)
                self._hold(0 if schema.id in self._schemas else len(body))
                _same(self._schemas.setdefault(schema.id, schema), schema)
            case p.CHANNEL:
                self._add_channel(p.channel_of(body), len(body))
            case p.METADATA:
                self._hold(len(body))
                name, values = p.metadata_of(body)
                self.metadata[name] = values
            case p.ATTACHMENT:
                self._attached += len(body)
                _bounded(self._attached, p.MAXIMUM_BYTES)
                attachment = p.attachment_of(body)
                self.attachments[attachment.name] = attachment
            case p.MESSAGE_INDEX:
                p.message_index_of(body)  # its content is not used

    def _add_channel(self, channel: p.ChannelRecord, length: int) -> None:
        self._hold(0 if channel.id in self._channels else length)
        _same(self._channels.setdefault(channel.id, channel), channel)
        if channel.schema_id:
            if channel.schema_id not in self._schemas:
                raise DamagedRecording(f"channel {channel.id} has a schema that there is not")
            self.schemas[channel.topic] = self._schemas[channel.schema_id].data

    def _hold(self, length: int) -> None:
        self._held += length
        _bounded(self._held, MAXIMUM_HELD)


def facts(path: Path) -> Iterator[RecordedFact]:
    """Yield the facts of the recording at ``path`` in the order of the file; see :meth:`Recording.facts`.

    For a file that is cut off, the iteration simply ends. If you need to know, use :attr:`Recording.report`.
    """
    return Recording(path).facts()


def recorded_fact(path: Path, m: RecordedMessage) -> RecordedFact:
    """Return a recorded message as a fact; ``path`` is for the error. Raises :class:`DamagedRecording`."""
    try:
        return RecordedFact(m.sequence, m.log_time, fact_of(m.topic, m.data))
    except MalformedMessage as e:
        raise DamagedRecording(f"{path.name}: {m.topic} {m.sequence}: {e.detail}") from e


def fact_of(topic: str, data: bytes) -> Fact:
    """Return a recorded message as a fact. Raises :class:`MalformedMessage`."""
    kind = FACTS.get(topic)
    if kind is None:
        raise MalformedMessage(f"{shorten(topic)!r} is no subject")
    if left_out := _nullable(kind):
        data = _with_nulls(data, left_out)
    return decode(kind, data)


def chunk_at(path: Path, offset: int) -> bytes:
    """Return the unpacked chunk at an offset from :meth:`Recording.located`. Raises :class:`DamagedRecording`."""
    try:
        with open(path, "rb") as stream:
            stream.seek(offset)
            opcode, length = p.HEAD.unpack(stream.read(p.HEAD.size).ljust(p.HEAD.size, b"\0"))
            p.check_head(opcode, length, {p.CHUNK})
            return p.chunk_content(memoryview(stream.read(length)))
    except (DamagedRecording, OSError) as e:
        raise DamagedRecording(f"{path.name}: the chunk at byte {offset}: {e}") from e


@cache
def _nullable(kind: type[Fact]) -> tuple[str, ...]:
    """Return the required fields that may be ``None``; a recording leaves them out when they are."""
    fields = kind.model_fields.items()
    return tuple(n for n, f in fields if f.is_required() and NoneType in get_args(f.annotation))


def _with_nulls(data: bytes, names: tuple[str, ...]) -> bytes:
    try:
        plain = json.loads(data)
    except (ValueError, RecursionError) as e:
        raise MalformedMessage("it is not readable as JSON") from e
    if not isinstance(plain, dict):
        return data
    return json.dumps({**dict.fromkeys(names), **plain}).encode()


def _bounded(held: int, most: int) -> None:
    if held > most:
        raise DamagedRecording(f"it holds more than {most} bytes of schemas, metadata or attachments")


def _same(one: object, other: object) -> None:
    if one != other:
        raise DamagedRecording("it gives the same schema or channel twice, and differently")
