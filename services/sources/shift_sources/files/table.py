"""Tables with a header line and columns separated by tabs or commas, plain or gzip, read line by line.

A format declares its columns as a :class:`TableFormat`. Plain text, gzip and UTF-16 are recognised by content, not by
the file's name.
"""

from __future__ import annotations

import csv
import gzip
import math
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
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
SEPARATORS = ("\t", ",", ";")
UTF_16 = (b"\xff\xfe", b"\xfe\xff")
"""The byte order marks of UTF-16."""


class Row:
    """One row of a table, with its place in the file for error messages."""

    def __init__(
        self, file: str, line: int, columns: dict[str, int], cells: list[str], decimal_comma: bool = False
    ) -> None:
        self.file, self.line, self.columns, self.cells = file, line, columns, cells
        self.decimal_comma = decimal_comma
        if len(cells) != len(columns):
            rule = f"as many cells as the header has, {len(columns)}; columns are separated as in the header"
            raise _mistake(file, line, "row", f"{len(cells)} cells", rule)

    def text(self, column: str) -> str:
        """Return the text of the cell."""
        return self.cells[self.columns[column]].strip()

    def number(self, column: str) -> float | None:
        """Return the number in the cell, or None if it is empty or ``nan``. Raise :class:`MalformedMessage`."""
        text = self.text(column)
        if self.decimal_comma and "." not in text:
            text = text.replace(",", ".", 1)
        if text.lower() in ("", "nan", "na"):
            return None
        try:
            value = float(text)
        except ValueError:
            raise self.wrong(column, "a number, or nothing where it was lost") from None
        if not math.isfinite(value):
            raise self.wrong(column, "a finite number, or nothing where it was lost")
        return value

    def ticks(self, column: str) -> float | None:
        """Return a time as :meth:`number` does. A whole number keeps all of its digits."""
        text = self.text(column)
        return int(text) if text.isdecimal() and text.isascii() else self.number(column)

    def wrong(self, column: str, rule: str) -> MalformedMessage:
        """Return the error that this cell does not follow ``rule``."""
        return _mistake(self.file, self.line, column, self.text(column), rule)


@dataclass(frozen=True)
class TableFormat:
    """One kind of table."""

    name: str
    time_column: str
    """The tracker's clock, rising from row to row."""
    columns: tuple[str, ...]
    """The columns that the header must have; the format is recognised by them."""
    sample: Callable[[float, Row], Sample | None]
    """Returns the sample of a row at ``t`` seconds, or None for a row that is no sample."""
    ticks: float = MICROSECONDS
    """Units of the time column in a second."""
    separator: str = "\t"
    repeats: bool = False
    """Whether rows may repeat a time or step back, as two eyes that are tracked one by one do; these are left out."""
    decimal_comma: bool = False
    """Whether numbers can have a decimal comma, as the program writes them on a computer of some countries."""
    pixels: bool = False
    """Whether positions are in pixels of the screen, whose size must be given."""


@dataclass(frozen=True)
class ScreenSize:
    """The size of the screen, or of the scene camera's picture, in pixels."""

    width: int
    height: int


Recogniser = Callable[[list[str], ScreenSize | None], TableFormat | None]
"""Returns the format of a table with this header, or None. Without a size, positions in pixels cannot be converted."""


def is_table(table: TableFormat) -> Recogniser:
    """Return the recogniser of a format whose header is always the same."""
    return lambda header, screen: table if set(table.columns) <= set(header) else None


def read_table(
    path: Path, formats: Mapping[str, Sequence[Recogniser]], screen: ScreenSize | None = None
) -> Iterator[Sample]:
    """Yield the samples of a table of one of the ``formats``; the first one that fits the header is used.

    Raises
    ------
    InvalidSettings
        The file cannot be opened, or its positions are in pixels and ``screen`` is not given.
    MalformedMessage
        The file is not such a table. The message names the file, the line, the value and the rule; it is raised when
        that line is reached.
    """
    with _opened(path) as lines:
        header, table = _recognised(lines.readline(LONGEST_LINE), formats, screen, path.name)
        if table.pixels and screen is None:
            raise InvalidSettings(
                f"{path.name} ({table.name}) has positions in pixels: give the size of the screen, or of the scene "
                "camera's picture, with --screen, such as --screen 1920x1080"
            )
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
        row = Row(name, number, columns, cells_of(line, table.separator), table.decimal_comma)
        time = row.ticks(table.time_column)
        if time is None or (time <= before and not table.repeats):
            raise row.wrong(table.time_column, "the tracker's clock, rising from row to row")
        if time <= before:
            continue
        sample = table.sample((time - (time if first is None else first)) / table.ticks, row)
        if sample is not None:
            first, before = time if first is None else first, time
            yield sample


@contextmanager
def _opened(path: Path) -> Iterator[IO[str]]:
    """Open plain text or gzip; report what is wrong with the file in a sentence."""
    try:
        with path.open("rb") as file:
            start = file.read(2)
        encoding = "utf-16" if start in UTF_16 else "utf-8-sig"
        with (
            gzip.open(path, "rt", encoding="utf-8-sig")
            if start == GZIP_MAGIC
            else path.open(encoding=encoding) as lines
        ):
            yield lines
    except UnicodeError as e:
        raise MalformedMessage(f"{path.name}: this is not text in UTF-8 or UTF-16; give a table or its gzip") from e
    except (EOFError, gzip.BadGzipFile, zlib.error) as e:
        raise MalformedMessage(f"{path.name}: the gzip file is damaged or cut off: {e}") from e
    except OSError as e:
        raise InvalidSettings(f"{path.name} cannot be read: {e.strerror or e}") from e


def _recognised(
    line: str, formats: Mapping[str, Sequence[Recogniser]], screen: ScreenSize | None, name: str
) -> tuple[list[str], TableFormat]:
    """Return the names of the columns and the format. Raise :class:`MalformedMessage` if none fits."""
    for recognisers in formats.values():
        for recogniser in recognisers:
            for separator in SEPARATORS:
                header = cells_of(line, separator)
                table = recogniser(header, screen)
                if table is not None and table.separator == separator:
                    return header, table
    rule = f"the header of one of these tables: {', '.join(formats)}; shift-mesh gaze formats lists their columns"
    raise _mistake(name, 1, "header", line.strip(), rule)


def cells_of(line: str, separator: str) -> list[str]:
    """Return the cells of a line; a cell in quotes may contain the separator."""
    line = line.rstrip("\r\n")
    return next(csv.reader([line], delimiter=separator), []) if '"' in line else line.split(separator)


def _mistake(file: str, line: int, field: str, value: str, rule: str) -> MalformedMessage:
    error = FieldError(field=field, value=shorten(value), rule=rule)
    return MalformedMessage(f"{file}:{line}: {field}: {error.value!r} is not valid: {rule}", (error,))
