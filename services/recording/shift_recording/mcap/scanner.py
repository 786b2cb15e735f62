"""Read the records of a file one after the other, with bounded memory, and check sections and checksums.

This is the first half of reading; it does not interpret the content of a record.
"""

from __future__ import annotations

import io
import os
import zlib
from collections.abc import Iterator

from shift_schemas.errors import DamagedRecording

from shift_recording.mcap import records as p


class CutOff(Exception):
    """The file ends too early: it was not finished, or it was truncated."""


class Scan:
    """One pass over an MCAP file, from its magic to its end.

    Attributes
    ----------
    good : int
        The file is valid up to this byte.
    in_summary : bool
        The data section is over; the rest of the file only summarises it.
    """

    def __init__(self, stream: io.BufferedReader) -> None:
        self._stream = stream
        self._left = os.fstat(stream.fileno()).st_size
        self._crc = 0
        self.good = 0
        self.in_summary = False

    def records(self) -> Iterator[tuple[int, int, memoryview]]:
        """Yield offset, kind and body of each record. Raises :class:`CutOff`, :class:`DamagedRecording`, OSError."""
        self._magic()
        yield self._record({p.HEADER})
        while True:
            record = self._record(p.SUMMARY_SECTION if self.in_summary else p.DATA_SECTION)
            yield record
            if record[1] == p.FOOTER:
                break
        self._magic()
        if self._left:
            raise DamagedRecording(f"{self._left} bytes follow its end")

    def _record(self, allowed: set[int]) -> tuple[int, int, memoryview]:
        offset, crc = self.good, self._crc
        head = self._take(p.HEAD.size)
        opcode, length = p.HEAD.unpack(head)
        p.check_head(opcode, length, allowed)
        body = memoryview(self._take(length))
        if opcode == p.DATA_END:
            _check_section("data", crc, int.from_bytes(body, "little"))
            self._crc, self.in_summary = 0, True
        elif opcode == p.FOOTER:
            _check_section("summary", zlib.crc32(head + body[:16], crc), int.from_bytes(body[16:], "little"))
        self.good = offset + len(head) + length
        return offset, opcode, body

    def _take(self, n: int) -> bytes:
        if n > self._left:
            raise CutOff
        data = self._stream.read(n)
        if len(data) != n:
            raise CutOff
        self._left -= n
        self._crc = zlib.crc32(data, self._crc)
        return data

    def _magic(self) -> None:
        there = min(len(p.MAGIC), self._left)
        if self._take(there) != p.MAGIC[:there]:
            raise DamagedRecording("this is not the beginning or end of an MCAP file")
        if there < len(p.MAGIC):
            raise CutOff
        self.good += there


def _check_section(what: str, found: int, crc: int) -> None:
    if crc and crc != found:
        raise DamagedRecording(f"the checksum of its {what} section is {crc:08x} and should be {found:08x}")
