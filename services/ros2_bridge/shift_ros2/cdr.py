"""CDR of the few ROS messages that the bridge reads and writes. Pure.

The format is classic little-endian CDR: a header of four bytes and then the fields, each aligned to its own size from
the end of the header. Fields are read by their length and never to the end of the buffer, since padding can follow.
"""

from __future__ import annotations

import struct

from shift_schemas.errors import MalformedMessage, shorten

HEADER = b"\x00\x01\x00\x00"
TRIGGER_REQUEST = HEADER + b"\x00"
"""A request of std_srvs/srv/Trigger has no fields, and a structure without members is written as one byte."""
LONGEST_REQUEST = 8
"""The one byte and its padding. Some clients send the header alone."""
_ORDERS = {0: ">", 1: "<"}


class CdrReader:
    """Reads fields in their order. Each method raises :class:`MalformedMessage` if the buffer ends too early."""

    def __init__(self, data: bytes) -> None:
        if len(data) < len(HEADER) or data[0] != 0 or data[1] not in _ORDERS:
            raise MalformedMessage(f"cdr: header {shorten(data[:4].hex())}: it must be 0001 (or 0000) and two bytes")
        self._data = data[len(HEADER) :]
        self._order = _ORDERS[data[1]]
        self._at = 0

    def uint8(self) -> int:
        """Read one byte."""
        return self._bytes(1)[0]

    def bool(self) -> bool:
        """Read one byte, which is 0 or 1."""
        value = self.uint8()
        if value > 1:
            raise MalformedMessage(f"cdr: bool {value}: it must be 0 or 1")
        return value == 1

    def uint32(self) -> int:
        """Read four bytes, aligned to four."""
        self._at += -self._at % 4
        value: int = struct.unpack(f"{self._order}I", self._bytes(4))[0]
        return value

    def string(self) -> str:
        """Read a string: its length with the final NUL, its bytes, and NUL."""
        length = self.uint32()
        raw = self._bytes(length)
        if length and raw[-1] != 0:
            raise MalformedMessage(f"cdr: string of {length} bytes: it must end with NUL")
        try:
            return raw[:-1].decode()
        except UnicodeDecodeError as e:
            raise MalformedMessage("cdr: string: it must be UTF-8") from e

    def strings(self) -> list[str]:
        """Read a sequence of strings."""
        count = self.uint32()
        if count * 4 > len(self._data) - self._at:
            raise MalformedMessage(f"cdr: sequence of {count} strings: the message is too short for it")
        return [self.string() for _ in range(count)]

    def _bytes(self, length: int) -> bytes:
        end = self._at + length
        if end > len(self._data):
            raise MalformedMessage(
                f"cdr: the message is too short: {length} bytes must follow, {max(0, len(self._data) - self._at)} do"
            )
        found = self._data[self._at : end]
        self._at = end
        return found


def encode_string(text: str) -> bytes:
    """Return a std_msgs/msg/String. Raise :class:`MalformedMessage` if the text contains NUL."""
    return HEADER + _string(text)


def decode_string(data: bytes) -> str:
    """Return the text of a std_msgs/msg/String."""
    return CdrReader(data).string()


def check_trigger_request(data: bytes) -> None:
    """Raise :class:`MalformedMessage` unless ``data`` is a std_srvs/srv/Trigger request."""
    CdrReader(data)
    if len(data) > LONGEST_REQUEST:
        raise MalformedMessage(f"cdr: a Trigger request of {len(data)} bytes: it has 4 or 5")


def encode_trigger_response(success: bool, message: str) -> bytes:
    """Return a response of std_srvs/srv/Trigger."""
    return HEADER + bytes([success, 0, 0, 0]) + _string(message)


def decode_trigger_response(data: bytes) -> tuple[bool, str]:
    """Return ``success`` and ``message`` of a Trigger response."""
    reader = CdrReader(data)
    return reader.bool(), reader.string()


def _string(text: str) -> bytes:
    raw = text.encode()
    if 0 in raw:
        raise MalformedMessage("cdr: string: it cannot hold NUL")
    return struct.pack("<I", len(raw) + 1) + raw + b"\x00"
