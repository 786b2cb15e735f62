"""Tables with a header line and columns separated by tabs, plain or gzip, read line by line.

A format declares its columns as a :class:`TableFormat`. Plain text and gzip are recognised by content, not by the
file's name.
"""

from __future__ import annotations

import gzip
import math
import zlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from shift_schemas.errors import FieldError, InvalidSettings, MalformedMessage, shorten

from shift_sources.files.samples import Sample

GZIP_MAGIC = b"\x1f\x8b"
LONGEST_LINE = 65_536
"""Chosen: characters; a row of a TX300 has 200."""
MICROSECONDS = 1_000_000


class Row:
    """One row of a table, with its place in the file for error messages."""

    def __init__(self, file: str, line: int, columns: dict[str, int], cells: list[str]) -> None:
        self.file, self.line, self.columns, self.cells = file, line, columns, cells
        if len(cells) != len(columns):
            rule = f"as many cells as the header has, {len(columns)}; columns are separated by tabs"
            raise _mistake(file, line, "row", f"{len(cells)} cells", rule)

    def text(self, column: str) -> str:
        """Return the text of the cell."""
        return self.cells[self.columns[column]].strip()

    def number(self, column: str) -> float | None:
        """Return the number in the cell, or None if it is empty or ``nan``. Raise :class:`MalformedMessage`."""
        text = self.text(column)
        if text.lower() in ("", "nan", "na"):
            return None
        try:
            value = float(text)
        except ValueError:
            raise self.wrong(column, "a number, or nothing where it was lost") from None
        if not math.isfinite(value):
            raise self.wrong(column, "a finite number, or nothing where it was lost")
        return value

    def wrong(self, column: str, rule: str) -> MalformedMessage:
        """Return the error that this cell does not follow ``rule``."""
        return _mistake(self.file, self.line, column, self.text(column), rule)


@dataclass(frozen=True)
class TableFormat:
    """One kind of table."""

    name: str
    time_column: str
    """Microseconds of the tracker's clock, rising from row to row."""
    columns: tuple[str, ...]
    """The columns that the header must have; the format is recognised by them."""
    sample: Callable[[float, Row], Sample]
    """Returns the sample of a row at ``t`` seconds."""


def read_table(path: Path, formats: Sequence[TableFormat]) -> Iterator[Sample]:
    """Yield the samples of a table of one of the ``formats``; the first one that fits the header is used.

    Raises
    ------
    InvalidSettings
        The file cannot be opened.
    MalformedMessage
        The file is not such a table. The message names the file, the line, the value and the rule; it is raised when
        that line is reached.
    """
    with _opened(path) as lines:
        header = _cells(lines.readline(LONGEST_LINE))
        table = _recognised(header, formats, path.name)
        columns = {column: i for i, column in enumerate(header)}
        yield from _samples(lines, table, columns, path.name)


def _samples(lines: IO[str], table: TableFormat, columns: dict[str, int], name: str) -> Iterator[Sample]:
    first: float | None = None
    before = -math.inf
    number = 1
    while line := lines.readline(LONGEST_LINE):
        number += 1
        if not line.strip():
            continue
        row = Row(name, number, columns, _cells(line))
        time = row.number(table.time_column)
        if time is None or time <= before:
            raise row.wrong(table.time_column, "microseconds of the tracker's clock, rising from row to row")
        first, before = time if first is None else first, time
        yield table.sample((time - first) / MICROSECONDS, row)


@contextmanager
def _opened(path: Path) -> Iterator[IO[str]]:
    """Open plain text or gzip; report what is wrong with the file in a sentence."""
    try:
        with path.open("rb") as file:
            zipped = file.read(2) == GZIP_MAGIC
        with gzip.open(path, "rt", encoding="utf-8-sig") if zipped else path.open(encoding="utf-8-sig") as lines:
            yield lines
    except UnicodeDecodeError as e:
        raise MalformedMessage(f"{path.name}: this is not text in UTF-8; give a table (TSV) or its gzip") from e
    except (EOFError, gzip.BadGzipFile, zlib.error) as e:
        raise MalformedMessage(f"{path.name}: the gzip file is damaged or cut off: {e}") from e
    except OSError as e:
        raise InvalidSettings(f"{path.name} cannot be read: {e.strerror or e}") from e


def _recognised(header: list[str], formats: Sequence[TableFormat], name: str) -> TableFormat:
    for table in formats:
        if set(table.columns) <= set(header):
            return table
    by_name: dict[str, tuple[str, ...]] = {}
    for table in formats:
        by_name.setdefault(table.name, table.columns)
    needed = "; ".join(f"{kind}: {', '.join(columns)}" for kind, columns in by_name.items())
    raise _mistake(name, 1, "header", " ".join(header), f"the columns of one of these tables ({needed})")


def _cells(line: str) -> list[str]:
    return line.rstrip("\r\n").split("\t")


def _mistake(file: str, line: int, field: str, value: str, rule: str) -> MalformedMessage:
    error = FieldError(field=field, value=shorten(value), rule=rule)
    return MalformedMessage(f"{file}:{line}: {field}: {error.value!r} is not valid: {rule}", (error,))
