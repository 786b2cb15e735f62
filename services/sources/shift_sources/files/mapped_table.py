"""Any table with one row a sample, whose columns the command line names (``--columns``, see ``column_map``).

Cells that are empty, ``nan``, ``NA`` or ``.`` are lost, and so are the values of ``--lost``. Positions are 0..1, pixels
(``--screen``), millimetres (``--screen-mm``) or degrees (``--screen-mm``, ``--distance-mm``), from the ``--origin``.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from shift_schemas.errors import InvalidSettings

from shift_sources.files.aoi_names import study_name
from shift_sources.files.column_map import ColumnMap, Validity, parse_columns
from shift_sources.files.options import Options, Origin
from shift_sources.files.positions import Point, from_degrees, from_upper_left
from shift_sources.files.samples import Eyes, Gaze, Sample, named_sample, sample_of_eyes
from shift_sources.files.table import SEPARATORS, Reader, Row, TableFormat, cells_of, gaze_of_table
from shift_sources.files.text_file import TextFile

NAME = "table of --columns"
YES, NO = frozenset({"true", "yes", "valid", "1", "1.0"}), frozenset({"false", "no", "invalid", "0", "0.0", ""})
Convert = Callable[[float, float], Point]


class _Cells:
    """Reads the cells of a row as ``--columns`` and ``--lost`` say."""

    def __init__(self, lost: tuple[str, ...]) -> None:
        self.lost = frozenset({".", *lost})
        self.lost_numbers = frozenset(number for text in lost if (number := _number(text)) is not None)

    def value(self, row: Row, column: str) -> float | None:
        """Return a number; None where it is lost. Raise :class:`MalformedMessage`."""
        if row.text(column) in self.lost:
            return None
        number = row.number(column)
        return None if number in self.lost_numbers else number

    def is_valid(self, row: Row, validity: Validity | None) -> bool:
        """Return whether a sample is valid. Raise :class:`MalformedMessage`."""
        if validity is None:
            return True
        text = row.text(validity.column)
        if validity.values:
            number = _number(text)
            return text in validity.values or (number is not None and number in map(_number, validity.values))
        if text.lower() not in YES | NO:
            raise row.wrong(validity.column, f"1 or 0, true or false; or name what is valid: {validity.column}:VALUE")
        return text.lower() in YES


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _point(t: float, row: Row, mapped: ColumnMap, cells: _Cells, convert: Convert) -> Sample:
    points = []
    for x_column, y_column, validity in mapped.points:
        x, y, valid = cells.value(row, x_column), cells.value(row, y_column), cells.is_valid(row, validity)
        if x is not None and y is not None and valid:
            points.append(convert(x, y))
    return sample_of_eyes(t, points, _eyes(row, mapped, cells))


def _name(t: float, row: Row, mapped: ColumnMap, cells: _Cells, options: Options) -> Sample:
    column = mapped.columns["aoi"]
    tracked = not mapped.validities or any(cells.is_valid(row, validity) for validity in mapped.validities)
    text = row.text(column)
    lost = text in cells.lost
    name = None if lost else study_name(text, options, lambda rule: row.wrong(column, rule))
    return named_sample(t, name, tracked and not lost, _eyes(row, mapped, cells))


def _eyes(row: Row, mapped: ColumnMap, cells: _Cells) -> Eyes:
    said = {name: cells.value(row, mapped.columns[name]) for name in Eyes._fields if name in mapped.columns}
    return Eyes(**{name: value if value is not None and value >= 0 else None for name, value in said.items()})


def _conversion(unit: str, options: Options) -> Convert:
    """Return the conversion to 0..1. Raise :class:`InvalidSettings` for what the command line must say."""
    origin = options.origin or Origin.TOP_LEFT
    size = options.screen_mm
    if unit in ("mm", "deg") and size is None:
        raise InvalidSettings(f"positions in {unit} need the size of the stimulus: give --screen-mm, such as 509x286")
    if unit == "deg":
        if options.distance_mm is None:
            raise InvalidSettings("positions in degrees need the distance of the eyes: give --distance-mm, such as 650")
        if options.origin not in (Origin.CENTRE, Origin.CENTRE_DOWN):
            raise InvalidSettings(
                "positions in degrees are from the centre: give --origin centre if y grows upwards, or --origin "
                "centre-down if it grows downwards"
            )
        assert size is not None
        degrees = partial(from_degrees, size=size, distance_mm=options.distance_mm)
        return lambda x, y: from_upper_left(*degrees(x, y), origin)
    width, height = 1.0, 1.0
    if unit == "mm" and size is not None:
        width, height = size.width, size.height
    elif unit == "px" and options.screen is not None:
        width, height = options.screen.width, options.screen.height
    return lambda x, y: from_upper_left(x / width, y / height, origin)


def _header(file: TextFile, columns: str) -> tuple[int, list[str], str]:
    """Return the line of the header, its names and the separator: the first line that has all columns of the map."""
    for number, line in enumerate(file.head, start=1):
        for separator in SEPARATORS:
            names = [name.strip() for name in cells_of(line, separator)]
            try:
                parse_columns(columns, names)
            except InvalidSettings:
                continue
            return number, names, separator
    text = next((line for line in file.head if line.strip() and not line.startswith("#")), "")
    names = max((cells_of(text, separator) for separator in SEPARATORS), key=len)
    parse_columns(columns, [name.strip() for name in names])
    raise AssertionError("the columns were not found before, with the same header")


def _read(file: TextFile, options: Options) -> Gaze | None:
    if not options.columns:
        raise InvalidSettings("the format columns needs --columns, such as --columns t=time:ms,x=gx:px,y=gy:px")
    line, header, separator = _header(file, options.columns)
    mapped, cells = parse_columns(options.columns, header), _Cells(options.lost)
    named = "aoi" in mapped.columns and (options.named or not mapped.points)
    sample: Callable[[float, Row], Sample]
    if named:
        sample = partial(_name, mapped=mapped, cells=cells, options=options)
    else:
        sample = partial(_point, mapped=mapped, cells=cells, convert=_conversion(mapped.unit, options))
    table = TableFormat(
        NAME, mapped.columns["t"], tuple(mapped.columns.values()), sample, mapped.ticks, separator,
        decimal_comma=separator != ",", pixels=mapped.unit == "px" and not named, named=named,
    )  # fmt: skip
    return gaze_of_table(file, table, header, options, line)


FORMATS: dict[str, tuple[Reader, ...]] = {"columns": (_read,)}
