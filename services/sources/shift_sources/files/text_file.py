"""Text files, plain or gzip, in UTF-8 or UTF-16, read line by line; all three are recognised by content."""

from __future__ import annotations

import gzip
import io
import re
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import chain, islice
from pathlib import Path
from typing import IO, cast

from shift_schemas.errors import FieldError, InvalidSettings, MalformedMessage, shorten

GZIP_MAGIC = b"\x1f\x8b"
LONGEST_LINE = 65_536
"""Chosen: characters; a row of a TX300 has 200."""
HEAD = 300
"""How many lines a format may look at to recognise a file. Chosen: headers of SMI have some 60."""
UTF_16 = (b"\xff\xfe", b"\xfe\xff")
"""The byte order marks of UTF-16."""
REMARK = re.compile(r"##|\*\*|MSG\b|[^\t]*\tMSG\t")
"""Lines of remarks and messages, whose text may be in another encoding; no number is in it."""
UNDECODED = re.compile("[\udc80-\udcff]")
"""How Python marks a byte that is not in the file's encoding."""


class TextFile:
    """An opened file: its path, its first lines, and all of its lines."""

    def __init__(self, path: Path, lines: IO[str]) -> None:
        self.path, self.name = path, path.name
        self._rest = (self._whole(line) for line in iter(lambda: lines.readline(LONGEST_LINE), ""))
        self.head = list(islice(self._rest, HEAD))
        """The first lines, with their line ends."""
        self.line = 0
        """The number of the line that was read last, from 1."""

    def lines(self) -> Iterator[tuple[int, str]]:
        """Yield each line with its number, from 1. A file is read once."""
        for number, text in enumerate(chain(self.head, self._rest), start=1):
            self.line = number
            yield number, text

    def wrong(self, line: int, field: str, value: str, rule: str) -> MalformedMessage:
        """Return the error that a field of a line does not follow ``rule``."""
        return mistake(self.name, line, field, value, rule)

    def _whole(self, line: str) -> str:
        if UNDECODED.search(line) is None:
            return line
        if REMARK.match(line) is None:
            raise MalformedMessage(f"{self.name}: this is not text in UTF-8 or UTF-16; give a table or its gzip")
        return UNDECODED.sub("�", line)


@contextmanager
def opened(path: Path) -> Iterator[TextFile]:
    """Open plain text or gzip; report what is wrong with the file in a sentence."""
    try:
        with path.open("rb") as plain:
            zipped = plain.read(2) == GZIP_MAGIC
            plain.seek(0)
            data = cast("IO[bytes]", gzip.GzipFile(fileobj=plain)) if zipped else plain
            encoding = "utf-16" if data.read(2) in UTF_16 else "utf-8-sig"
            data.seek(0)
            with io.TextIOWrapper(data, encoding=encoding, errors="surrogateescape") as lines:
                yield TextFile(path, lines)
    except UnicodeError as e:
        raise MalformedMessage(f"{path.name}: this is not text in UTF-8 or UTF-16; give a table or its gzip") from e
    except (EOFError, gzip.BadGzipFile, zlib.error) as e:
        raise MalformedMessage(f"{path.name}: the gzip file is damaged or cut off: {e}") from e
    except OSError as e:
        raise InvalidSettings(f"{path.name} cannot be read: {e.strerror or e}") from e


def mistake(file: str, line: int, field: str, value: str, rule: str) -> MalformedMessage:
    """Return the error that a field does not follow ``rule``, with its place in the file."""
    error = FieldError(field=field, value=shorten(value), rule=rule)
    return MalformedMessage(f"{file}:{line}: {field}: {error.value!r} is not valid: {rule}", (error,))
