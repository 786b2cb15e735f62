"""MCAP records from bytes that cannot be trusted.

Pure. Every length is checked against what is there *before* anything is made of it, and every record
must fill its length exactly: of a flipped bit in a length, other readers skip what follows. All that
goes wrong is a :class:`DamagedRecording`. Format: https://mcap.dev/spec.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

import lz4.frame  # type: ignore[import-untyped]
import zstandard
from shift_schemas.errors import DamagedRecording, shorten

MAGIC = b"\x89MCAP0\r\n"
HEAD = struct.Struct("<BQ")  # opcode, length
_MESSAGE = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time

HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX = 1, 2, 3, 4, 5, 6, 7
CHUNK_INDEX, ATTACHMENT, ATTACHMENT_INDEX, STATISTICS, METADATA, METADATA_INDEX = 8, 9, 10, 11, 12, 13
SUMMARY_OFFSET, DATA_END = 14, 15

MAXIMUM_BYTES = 32 * 2**20
"""Of a chunk, packed or unpacked, and of an attachment. We write 4 MB; a reader holds two such things."""
MAXIMUM_SMALL_BYTES = 2**20
"""Of any other record: a few bytes of it may become hundreds in memory."""

DATA_SECTION = {SCHEMA, CHANNEL, CHUNK, MESSAGE_INDEX, ATTACHMENT, METADATA, DATA_END}
"""What may stand before the data's end. Messages outside chunks have no checksum: we neither write nor take them."""
SUMMARY_SECTION = {
    SCHEMA, CHANNEL, STATISTICS, CHUNK_INDEX, ATTACHMENT_INDEX, METADATA_INDEX, SUMMARY_OFFSET, FOOTER,
}  # fmt: skip
_LARGE = {CHUNK, ATTACHMENT, MESSAGE_INDEX}
_FIXED = {FOOTER: 20, DATA_END: 4, SUMMARY_OFFSET: 17}


class SchemaRecord(NamedTuple):
    """A schema."""

    id: int
    name: str
    encoding: str
    data: bytes


class ChannelRecord(NamedTuple):
    """A channel; its own metadata is not kept."""

    id: int
    schema_id: int
    topic: str
    encoding: str


class MessageRecord(NamedTuple):
    """A message; times in ns."""

    channel_id: int
    sequence: int
    log_time: int
    publish_time: int
    data: bytes


@dataclass(frozen=True)
class Attachment:
    """A file within a recording. ``log_time`` in ns since the epoch."""

    name: str
    media_type: str
    data: bytes
    log_time: int


class Cursor:
    """Takes one field after the other out of a record; never more than there is."""

    def __init__(self, body: memoryview, what: str) -> None:
        self._body, self._what, self.at = body, what, 0

    def take(self, n: int) -> memoryview:
        """The next ``n`` bytes."""
        if n > len(self._body) - self.at:
            raise DamagedRecording(f"a {self._what} claims more than its {len(self._body)} bytes")
        self.at += n
        return self._body[self.at - n : self.at]

    def number(self, n: int) -> int:
        """An unsigned number of ``n`` bytes."""
        return int.from_bytes(self.take(n), "little")

    def text(self) -> str:
        """A text after its length."""
        try:
            return str(self.take(self.number(4)), "utf-8")
        except UnicodeDecodeError as e:
            raise DamagedRecording(f"a {self._what} has a text that is not UTF-8") from e

    def mapping(self) -> dict[str, str]:
        """A map of texts after its length."""
        end = self.number(4) + self.at
        pairs = {}
        while self.at < end:
            key = self.text()
            pairs[key] = self.text()
        if self.at != end:
            raise DamagedRecording(f"a {self._what} has a map that is longer than it says")
        return pairs

    def end(self) -> None:
        """The record must end here."""
        if self.at != len(self._body):
            raise DamagedRecording(f"a {self._what} has {len(self._body)} bytes and fills {self.at}")


def check_head(opcode: int, length: int, allowed: set[int]) -> None:
    """Refuses a record that cannot stand here or is larger than it may be."""
    if opcode not in allowed:
        raise DamagedRecording(f"a record of kind {opcode} cannot stand here")
    most = MAXIMUM_BYTES if opcode in _LARGE else MAXIMUM_SMALL_BYTES
    if length > most or length != _FIXED.get(opcode, length):
        raise DamagedRecording(f"a record of kind {opcode} claims {length} bytes; at most {most} are taken")


def records_in(content: bytes) -> Iterator[tuple[int, int, memoryview]]:
    """Kind, position and body of each record in an unpacked chunk."""
    view, at, size = memoryview(content), 0, len(content)
    while at < size:
        if size - at < HEAD.size:
            raise DamagedRecording("a chunk ends within a record")
        opcode, length = HEAD.unpack_from(content, at)
        start = at + HEAD.size
        if length > size - start:
            raise DamagedRecording("a record claims more than its chunk holds")
        yield opcode, at, view[start : start + length]
        at = start + length


def message_of(body: memoryview) -> MessageRecord:
    """A message."""
    if len(body) < _MESSAGE.size:
        raise DamagedRecording(f"a message of {len(body)} bytes is too short to be one")
    channel_id, sequence, log_time, publish_time = _MESSAGE.unpack_from(body)
    return MessageRecord(channel_id, sequence, log_time, publish_time, bytes(body[_MESSAGE.size :]))


def message_at(content: bytes, position: int) -> MessageRecord:
    """The message at a position that :func:`records_in` gave."""
    _, length = HEAD.unpack_from(content, position)
    start = position + HEAD.size
    return message_of(memoryview(content)[start : start + length])


def header_of(body: memoryview) -> tuple[str, str]:
    """Profile and library."""
    c = Cursor(body, "header")
    found = c.text(), c.text()
    c.end()
    return found


def schema_of(body: memoryview) -> SchemaRecord:
    """A schema."""
    c = Cursor(body, "schema")
    found = SchemaRecord(c.number(2), c.text(), c.text(), bytes(c.take(c.number(4))))
    c.end()
    return found


def channel_of(body: memoryview) -> ChannelRecord:
    """A channel."""
    c = Cursor(body, "channel")
    found = ChannelRecord(c.number(2), c.number(2), c.text(), c.text())
    c.mapping()
    c.end()
    return found


def metadata_of(body: memoryview) -> tuple[str, dict[str, str]]:
    """A metadata record: its name and values. It has no checksum of its own."""
    c = Cursor(body, "metadata record")
    found = c.text(), c.mapping()
    c.end()
    return found


def attachment_of(body: memoryview) -> Attachment:
    """An attachment, checked against its checksum."""
    c = Cursor(body, "attachment")
    log_time, _made = c.number(8), c.number(8)
    name, media_type = c.text(), c.text()
    data = bytes(c.take(c.number(8)))
    _check_crc("attachment", body[: c.at], c.number(4))
    c.end()
    return Attachment(name, media_type, data, log_time)


def check_message_index(body: memoryview) -> None:
    """An index must be one; what it says is not used."""
    c = Cursor(body, "message index")
    c.number(2)
    c.take(c.number(4))
    c.end()


def chunk_content(body: memoryview) -> bytes:
    """A chunk's records, unpacked, of the size that it says and checked against its checksum."""
    c = Cursor(body, "chunk")
    c.take(16)  # the times of its first and last message
    size, crc = c.number(8), c.number(4)
    compression = c.text()
    packed = c.take(c.number(8))
    c.end()
    if size > MAXIMUM_BYTES:
        raise DamagedRecording(f"a chunk claims to unpack to {size} bytes; at most {MAXIMUM_BYTES} are taken")
    content = _unpacked(compression, packed, size)
    _check_crc("chunk", content, crc)
    return content


def _unpacked(compression: str, packed: memoryview, size: int) -> bytes:
    unpack = _UNPACK.get(compression)
    if unpack is None:
        raise DamagedRecording(f"a chunk is packed by {shorten(compression)!r}, which nobody knows")
    try:
        content = unpack(packed, size)
    except (zstandard.ZstdError, RuntimeError, ValueError, EOFError, MemoryError) as e:
        raise DamagedRecording(f"a chunk cannot be unpacked: {shorten(str(e))}") from e
    if len(content) != size:
        raise DamagedRecording(f"a chunk says that it unpacks to {size} bytes, and does not")
    return content


def _zstd(packed: memoryview, size: int) -> bytes:
    unpacker = zstandard.ZstdDecompressor(max_window_size=MAXIMUM_BYTES)
    with unpacker.stream_reader(packed) as stream:
        return stream.read(size + 1)


def _lz4(packed: memoryview, size: int) -> bytes:
    found: bytes = lz4.frame.LZ4FrameDecompressor().decompress(packed, max_length=size + 1)
    return found


_UNPACK: dict[str, Callable[[memoryview, int], bytes]] = {
    "zstd": _zstd, "lz4": _lz4, "": lambda packed, size: bytes(packed),
}  # fmt: skip
"""How a chunk is unpacked, to at most one byte more than it says."""


def _check_crc(what: str, data: bytes | memoryview, crc: int) -> None:
    if crc and crc != (found := zlib.crc32(data)):  # 0: it has none
        raise DamagedRecording(f"the checksum of {what} is {crc:08x} and should be {found:08x}")
