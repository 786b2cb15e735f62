"""Tables with a header line and columns separated by tabs, commas or semicolons, read line by line.

A format declares its columns as a :class:`TableFormat`.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from shift_schemas.errors import InvalidSettings, MalformedMessage

from shift_sources.files.options import Options, ScreenSize
from shift_sources.files.samples import Gaze, Sample
from shift_sources.files.text_file import TextFile, mistake

MICROSECONDS = 1_000_000
LONGEST_TIME = 20
"""Digits of a whole time; nanoseconds since 1970 have 19."""
SEPARATORS = ("\t", ",", ";")


class Header:
    """The names of a table's columns with their positions; of two columns with one name, the first one counts."""

    def __init__(self, names: list[str]) -> None:
        self.width = len(names)
        self.columns = {name: i for i, name in reversed(list(enumerate(names)))}


class Row:
    """One row of a table, with its place in the file for error messages."""

    def __init__(self, file: str, line: int, header: Header, cells: list[str], decimal_comma: bool = False) -> None:
        self.file, self.line, self.columns, self.cells = file, line, header.columns, cells
        self.decimal_comma = decimal_comma
        if len(cells) != header.width:
            rule = f"as many cells as the header has, {header.width}; columns are separated as in the header"
            raise mistake(file, line, "row", f"{len(cells)} cells", rule)

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

    def size(self, column: str) -> float | None:
        """Return a pupil's size; None if it is lost, as a size of 0 or less is, or if there is no such column."""
        value = self.number(column) if column in self.columns else None
        return value if value is not None and value > 0 else None

    def openness(self, column: str) -> float | None:
        """Return an eye's openness, of which 0 is a closed eye; None as in :meth:`size`, but below 0."""
        value = self.number(column) if column in self.columns else None
        return value if value is not None and value >= 0 else None

    def ticks(self, column: str) -> float | None:
        """Return a time as :meth:`number` does. A whole number keeps all of its digits."""
        text = self.text(column)
        whole = text.isdecimal() and text.isascii() and len(text) <= LONGEST_TIME
        return int(text) if whole else self.number(column)

    def wrong(self, column: str, rule: str) -> MalformedMessage:
        """Return the error that this cell does not follow ``rule``."""
        return self.wrong_place(column, self.text(column), rule)

    def wrong_place(self, field: str, value: str, rule: str) -> MalformedMessage:
        """Return the error that something else of this row does not follow ``rule``."""
        return mistake(self.file, self.line, field, value, rule)


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
    named: bool = False
    """Whether the samples are AOI names and not points."""
    taken: Callable[[Row], bool] | None = None
    """Returns whether a row belongs to the recording that is read; None: all rows do."""


Recogniser = Callable[[list[str], Options], TableFormat | None]
"""Returns the format of a table with this header, or None."""
Reader = Callable[[TextFile, Options], Gaze | None]
"""Returns the gaze of a file, or None if the file does not have the reader's format."""


def is_table(table: TableFormat) -> Reader:
    """Return the reader of a format whose header is always the same."""
    return table_reader(lambda header, options: table if set(table.columns) <= set(header) else None)


def table_reader(recognise: Recogniser) -> Reader:
    """Return the reader of a table whose first line is its header.

    The reader raises :class:`InvalidSettings` if the command line must say something and does not, and
    :class:`MalformedMessage`, when that line is reached, for a mistake in the table. The message names the file, the
    line, the column, the value and the rule.
    """

    def read(file: TextFile, options: Options) -> Gaze | None:
        first = file.head[0] if file.head else ""
        for separator in SEPARATORS:
            header = cells_of(first, separator)
            table = recognise(header, options)
            if table is not None and table.separator == separator:
                return gaze_of_table(file, table, header, options)
        return None

    return read


def gaze_of_table(file: TextFile, table: TableFormat, header: list[str], options: Options, line: int = 1) -> Gaze:
    """Return the gaze of a table whose header is at this line. Raise :class:`InvalidSettings` as the reader does."""
    if table.pixels and options.screen is None:
        raise InvalidSettings(
            f"{file.name} ({table.name}) has positions in pixels: give the size of the screen, or of the scene "
            "camera's picture, with --screen, such as --screen 1920x1080"
        )
    if not table.named:
        refuse_names(file.name, table.name, options)
    return Gaze(_samples(file, table, Header(header), line), table.named)


def refuse_names(file: str, format_: str, options: Options) -> None:
    """Raise :class:`InvalidSettings` if AOI names are asked for, of a file that has none."""
    if options.named:
        raise InvalidSettings(f"{file} ({format_}) has no AOI names; leave --aoi out to take its points")


def check_screen(file: str, said: ScreenSize, options: Options) -> None:
    """Raise :class:`InvalidSettings` if the command line gives another size than the file."""
    if options.screen not in (None, said):
        raise InvalidSettings(
            f"{file} says that its screen has {said} pixels, and --screen says {options.screen}: leave --screen out"
        )


def _samples(file: TextFile, table: TableFormat, header: Header, header_line: int) -> Iterator[Sample]:
    first: float | None = None
    before = -math.inf
    for number, line in file.lines():
        if number <= header_line or not line.strip():
            continue
        row = Row(file.name, number, header, cells_of(line, table.separator), table.decimal_comma)
        if table.taken is not None and not table.taken(row):
            continue
        time = row.ticks(table.time_column)
        if time is None or (time <= before and not table.repeats):
            raise row.wrong(table.time_column, "the tracker's clock, rising from row to row")
        if time <= before:
            continue
        sample = table.sample((time - (time if first is None else first)) / table.ticks, row)
        if sample is not None:
            first, before = time if first is None else first, time
            yield sample


def cells_of(line: str, separator: str) -> list[str]:
    """Return the cells of a line; a cell in quotes may contain the separator."""
    line = line.rstrip("\r\n")
    return next(csv.reader([line], delimiter=separator), []) if '"' in line else line.split(separator)
