"""Reading gaze recordings: Tobii TX300 and Titta tables, plain or gzip, line by line.

The samples are those of the MODEL: seconds since the file's first sample on the tracker's clock, one
point, 0..1 from the upper left corner. Two eyes: the mean of the valid ones; none: the sample is lost.
"""

from __future__ import annotations

import gzip
import math
import zlib
from collections.abc import Iterable, Iterator
from itertools import islice
from pathlib import Path
from typing import IO, NamedTuple

from shift_schemas.errors import FieldError, InvalidSettings, MalformedMessage, shorten
from shift_schemas.messages import GazeChunk

GZIP_MAGIC = b"\x1f\x8b"
LONGEST_LINE = 65_536
"""Chosen: characters; a TX300 row has 200."""
MICROSECONDS = 1_000_000
LOST = -1.0
"""What a TX300 writes for a coordinate that it lost."""
LARGEST_VALIDITY = 1.0
"""TX300: 0 certain, 1 probable, 2 unsure which eye, 3 probably the other, 4 not found (Tobii's manual)."""
YES, NO = frozenset({"true", "1", "1.0"}), frozenset({"false", "0", "0.0", ""})


class Sample(NamedTuple):
    """One sample; x and y are none where it was lost."""

    t: float
    x: float | None
    y: float | None
    valid: bool


class Eye(NamedTuple):
    """The columns of one eye."""

    x: str
    y: str
    validity: str


class Layout(NamedTuple):
    """A kind of table: its clock, microseconds, and its eyes."""

    name: str
    time: str
    eyes: tuple[Eye, Eye]
    flags: bool
    """Whether validity is yes or no; else it is a TX300's 0..4."""


def _titta(time: str, validity: str) -> Layout:
    point = "gaze_point_on_display_area"
    eyes = [Eye(f"{e}_{point}_x", f"{e}_{point}_y", f"{e}_{validity}") for e in ("left", "right")]
    return Layout("Titta", time, (eyes[0], eyes[1]), True)


LAYOUTS: tuple[Layout, ...] = (
    Layout(
        "Tobii TX300",
        "Time",
        (Eye("LGazePos2dx", "LGazePos2dy", "LValidity"), Eye("RGazePos2dx", "RGazePos2dy", "RValidity")),
        False,
    ),
    *(
        _titta(time, validity)
        for time in ("device_time_stamp", "system_time_stamp")
        for validity in ("gaze_point_valid", "gaze_point_validity")
    ),
)
"""In the order in which they are looked for; the tracker's own clock before the computer's."""


def samples(path: Path) -> Iterator[Sample]:
    """The samples of a recording, in order.

    Raises
    ------
    InvalidSettings
        The file cannot be opened.
    MalformedMessage
        It is no such table; the message gives file, line, value and rule. Raised when that line is reached.
    """
    try:
        with _opened(path) as lines:
            yield from _samples(lines, path.name)
    except UnicodeDecodeError as e:
        raise MalformedMessage(f"{path.name}: this is not text in UTF-8; give a table (TSV) or its gzip") from e
    except (EOFError, gzip.BadGzipFile, zlib.error) as e:
        raise MalformedMessage(f"{path.name}: the gzip file is damaged or cut off: {e}") from e
    except OSError as e:
        raise InvalidSettings(f"{path.name} cannot be read: {e.strerror or e}") from e


def chunks(samples: Iterable[Sample], n: int, source: str = "file") -> Iterator[GazeChunk]:
    """The samples as chunks of ``n``, numbered from 0; the last may be shorter."""
    rest = iter(samples)
    seq = 0
    while part := list(islice(rest, n)):
        yield GazeChunk(
            source=source,
            seq=seq,
            t=[s.t for s in part],
            x=[s.x for s in part],
            y=[s.y for s in part],
            valid=[s.valid for s in part],
        )
        seq += 1


def _opened(path: Path) -> IO[str]:
    with path.open("rb") as file:
        zipped = file.read(2) == GZIP_MAGIC
    return gzip.open(path, "rt", encoding="utf-8-sig") if zipped else path.open("rt", encoding="utf-8-sig")


def _samples(lines: IO[str], name: str) -> Iterator[Sample]:
    header = _cells(lines.readline(LONGEST_LINE))
    layout = _layout(header, name)
    columns = {column: i for i, column in enumerate(header)}
    first: float | None = None
    before = -math.inf
    number = 1
    while line := lines.readline(LONGEST_LINE):
        number += 1
        if not line.strip():
            continue
        row = _Row(name, number, columns, _cells(line))
        time = row.number(layout.time)
        if time is None or time <= before:
            raise row.wrong(layout.time, "microseconds of the tracker's clock, rising from row to row")
        first, before = time if first is None else first, time
        yield _sample((time - first) / MICROSECONDS, row, layout)


class _Row:
    """One row, and where it stands."""

    def __init__(self, file: str, line: int, columns: dict[str, int], cells: list[str]) -> None:
        self.file, self.line, self.columns, self.cells = file, line, columns, cells
        if len(cells) != len(columns):
            rule = f"as many cells as the header has, {len(columns)}; columns are separated by tabs"
            raise _mistake(file, line, "row", f"{len(cells)} cells", rule)

    def number(self, column: str) -> float | None:
        """The cell's number; none where it is empty or nan."""
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

    def text(self, column: str) -> str:
        return self.cells[self.columns[column]].strip()

    def wrong(self, column: str, rule: str) -> MalformedMessage:
        return _mistake(self.file, self.line, column, self.text(column), rule)


def _sample(t: float, row: _Row, layout: Layout) -> Sample:
    points = [point for eye in layout.eyes if (point := _point(row, eye, layout)) is not None]
    if not points:
        return Sample(t, None, None, False)
    return Sample(t, sum(x for x, _ in points) / len(points), sum(y for _, y in points) / len(points), True)


def _point(row: _Row, eye: Eye, layout: Layout) -> tuple[float, float] | None:
    """Where one eye looked; none where it was lost."""
    x, y = row.number(eye.x), row.number(eye.y)
    seen = _flag(row, eye.validity) if layout.flags else _certain(row, eye.validity)
    if not seen or x is None or y is None or (not layout.flags and LOST in (x, y)):
        return None
    return x, y


def _certain(row: _Row, column: str) -> bool:
    value = row.number(column)
    if value is not None and not 0 <= value <= 4:
        raise row.wrong(column, "0 (certain) to 4 (not found)")
    return value is not None and value <= LARGEST_VALIDITY


def _flag(row: _Row, column: str) -> bool:
    text = row.text(column).lower()
    if text not in YES | NO:
        raise row.wrong(column, "True or False, 1 or 0")
    return text in YES


def _layout(header: list[str], name: str) -> Layout:
    for layout in LAYOUTS:
        if {layout.time, *(column for eye in layout.eyes for column in eye)} <= set(header):
            return layout
    needs = "; ".join(
        f"{layout.name}: {', '.join([layout.time, *(c for eye in layout.eyes for c in eye)])}"
        for layout in (LAYOUTS[0], LAYOUTS[1])
    )
    raise _mistake(name, 1, "header", " ".join(header), f"the columns of one of these tables ({needs})")


def _cells(line: str) -> list[str]:
    return line.rstrip("\r\n").split("\t")


def _mistake(file: str, line: int, field: str, value: str, rule: str) -> MalformedMessage:
    error = FieldError(field=field, value=shorten(value), rule=rule)
    return MalformedMessage(f"{file}:{line}: {field}: {error.value!r} is not valid: {rule}", (error,))
