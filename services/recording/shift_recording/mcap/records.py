"""Parse MCAP records from untrusted bytes.

Pure. Every length is checked against the available bytes *before* it is used, and every record must fill its length
exactly: other readers skip the following data where a bit of a length is flipped. Every error is a
:class:`DamagedRecording`. Format: https://mcap.dev/spec.
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
_INDEXED = struct.Struct("<QQ")
_MESSAGE = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time

HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX = 1, 2, 3, 4, 5, 6, 7
CHUNK_INDEX, ATTACHMENT, ATTACHMENT_INDEX, STATISTICS, METADATA, METADATA_INDEX = 8, 9, 10, 11, 12, 13
SUMMARY_OFFSET, DATA_END = 14, 15

MAXIMUM_BYTES = 32 * 2**20
"""Bytes of a chunk, packed or unpacked, and of an attachment. SHIFT writes 4 MB; a reader holds two of them."""
MAXIMUM_SMALL_BYTES = 2**20
"""Bytes of any other record; a few bytes of it can become hundreds in memory."""

DATA_SECTION = {SCHEMA, CHANNEL, CHUNK, MESSAGE_INDEX, ATTACHMENT, METADATA, DATA_END}
"""The records of the data section. Messages outside chunks have no checksum, so they are not written or accepted."""
SUMMARY_SECTION = {
    SCHEMA, CHANNEL, STATISTICS, CHUNK_INDEX, ATTACHMENT_INDEX, METADATA_INDEX, SUMMARY_OFFSET, FOOTER,
}  # fmt: skip
_LARGE = {CHUNK, ATTACHMENT, MESSAGE_INDEX}
_FIXED = {FOOTER: 20, DATA_END: 4, SUMMARY_OFFSET: 17}


class SchemaRecord(NamedTuple):
    """A schema record."""

    id: int
    name: str
    encoding: str
    data: bytes


class ChannelRecord(NamedTuple):
    """A channel record, without the channel's own metadata."""

    id: int
    schema_id: int
    topic: str
    encoding: str


class MessageRecord(NamedTuple):
    """A message record; times are in ns since the epoch."""

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
    """Reads the fields of a record one after the other, and never beyond its end."""

    def __init__(self, body: memoryview, what: str) -> None:
        self._body, self._what, self.at = body, what, 0

    def take(self, n: int) -> memoryview:
        """Return the next ``n`` bytes."""
        if n > len(self._body) - self.at:
            raise DamagedRecording(f"a {self._what} claims more than its {len(self._body)} bytes")
        self.at += n
        return self._body[self.at - n : self.at]

    def number(self, n: int) -> int:
        """Return an unsigned integer of ``n`` bytes."""
        return int.from_bytes(self.take(n), "little")

    def text(self) -> str:
        """Return a string, which follows its length."""
        try:
            return str(self.take(self.number(4)), "utf-8")
        except UnicodeDecodeError as e:
            raise DamagedRecording(f"a {self._what} has a text that is not UTF-8") from e

    def mapping(self) -> dict[str, str]:
        """Return a map of strings, which follows its length."""
        end = self.number(4) + self.at
        pairs = {}
        while self.at < end:
            key = self.text()
            pairs[key] = self.text()
        if self.at != end:
            raise DamagedRecording(f"a {self._what} has a map that is longer than it says")
        return pairs

    def end(self) -> None:
        """Raise :class:`DamagedRecording` unless the record ends here."""
        if self.at != len(self._body):
            raise DamagedRecording(f"a {self._what} has {len(self._body)} bytes and fills {self.at}")


def check_head(opcode: int, length: int, allowed: set[int]) -> None:
    """Raise :class:`DamagedRecording` for a record that is not allowed here or is too large."""
    if opcode not in allowed:
        raise DamagedRecording(f"a record of kind {opcode} cannot stand here")
    most = MAXIMUM_BYTES if opcode in _LARGE else MAXIMUM_SMALL_BYTES
    if length > most or length != _FIXED.get(opcode, length):
        raise DamagedRecording(f"a record of kind {opcode} claims {length} bytes; at most {most} are taken")


def records_in(content: bytes) -> Iterator[tuple[int, int, memoryview]]:
    """Yield kind, position and body of each record in an unpacked chunk."""
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
    """Return the message record in ``body``."""
    if len(body) < _MESSAGE.size:
        raise DamagedRecording(f"a message of {len(body)} bytes is too short to be one")
    channel_id, sequence, log_time, publish_time = _MESSAGE.unpack_from(body)
    return MessageRecord(channel_id, sequence, log_time, publish_time, bytes(body[_MESSAGE.size :]))


def message_at(content: bytes, position: int) -> MessageRecord:
    """Return the message at a position from :func:`records_in`."""
    _, length = HEAD.unpack_from(content, position)
    start = position + HEAD.size
    return message_of(memoryview(content)[start : start + length])


def header_of(body: memoryview) -> tuple[str, str]:
    """Return the profile and the library of a header record."""
    c = Cursor(body, "header")
    found = c.text(), c.text()
    c.end()
    return found


def schema_of(body: memoryview) -> SchemaRecord:
    """Return the schema record in ``body``."""
    c = Cursor(body, "schema")
    found = SchemaRecord(c.number(2), c.text(), c.text(), bytes(c.take(c.number(4))))
    c.end()
    return found


def channel_of(body: memoryview) -> ChannelRecord:
    """Return the channel record in ``body``."""
    c = Cursor(body, "channel")
    found = ChannelRecord(c.number(2), c.number(2), c.text(), c.text())
    c.mapping()
    c.end()
    return found


def metadata_of(body: memoryview) -> tuple[str, dict[str, str]]:
    """Return the name and the values of a metadata record, which has no checksum of its own."""
    c = Cursor(body, "metadata record")
    found = c.text(), c.mapping()
    c.end()
    return found


def attachment_of(body: memoryview) -> Attachment:
    """Return an attachment after checking its checksum."""
    c = Cursor(body, "attachment")
    log_time, _made = c.number(8), c.number(8)
    name, media_type = c.text(), c.text()
    data = bytes(c.take(c.number(8)))
    _check_crc("attachment", body[: c.at], c.number(4))
    c.end()
    return Attachment(name, media_type, data, log_time)


def message_index_of(body: memoryview) -> list[int]:
    """Return the positions of a channel's messages in their unpacked chunk."""
    c = Cursor(body, "message index")
    c.number(2)
    pairs = c.take(c.number(4))
    c.end()
    if len(pairs) % _INDEXED.size:
        raise DamagedRecording(f"a message index has {len(pairs)} bytes, which is no number of entries")
    return [position for _time, position in _INDEXED.iter_unpack(pairs)]


def chunk_content(body: memoryview) -> bytes:
    """Return the unpacked records of a chunk after checking its size and its checksum."""
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
"""The decompressors; each returns at most one byte more than the chunk's stated size."""


def _check_crc(what: str, data: bytes | memoryview, crc: int) -> None:
    if crc and crc != (found := zlib.crc32(data)):  # 0 means that there is no checksum
        raise DamagedRecording(f"the checksum of {what} is {crc:08x} and should be {found:08x}")
