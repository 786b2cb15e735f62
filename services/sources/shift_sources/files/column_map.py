"""The text of ``--columns``: which column of a table is what, and in which unit. Pure.

The text is a list with commas of ``FIELD=COLUMN`` or ``FIELD=COLUMN:UNIT``:

    t=timestamp:ms,x=gaze_x:px,y=gaze_y:px,valid=ok,pupil_left=pl
    t=n:ms,x=x:deg,y=y:deg,valid=val:0
    t=time:s,left_x=lx:norm,left_y=ly:norm,left_valid=lv:1|2,right_x=rx:norm,right_y=ry:norm
    t=time:us,aoi=target

``t`` and positions need a unit. ``valid`` may name the values that mean a valid sample, with ``|`` between them. A
column's name may have spaces, colons and commas.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

from shift_schemas.errors import InvalidSettings
from shift_schemas.suggestions import did_you_mean

from shift_sources.files.options import TIME_UNITS

POSITION_UNITS = ("norm", "px", "mm", "deg")
"""0..1 of the stimulus, pixels, millimetres, degrees of visual angle."""
POSITIONS = ("x", "y", "left_x", "left_y", "right_x", "right_y")
VALIDITIES = ("valid", "left_valid", "right_valid")
EYES = ("pupil_left", "pupil_right", "openness_left", "openness_right")
FIELDS = ("t", *POSITIONS, *VALIDITIES, "aoi", *EYES)
EXAMPLE = "t=time:ms,x=gx:px,y=gy:px"
_ITEM = re.compile(r"(?:^|,)\s*([A-Za-z_]+)\s*=")


class Validity(NamedTuple):
    """A column of validity."""

    column: str
    values: tuple[str, ...]
    """What means valid; empty: true, yes, valid or 1."""


class ColumnMap(NamedTuple):
    """The columns of a table."""

    columns: dict[str, str]
    """The column of each field that was given."""
    ticks: float
    """Units of the time in a second."""
    unit: str
    """Of all positions; empty: the table has no positions."""
    points: tuple[tuple[str, str, Validity | None], ...]
    """The columns of x, y and validity: of both eyes together, or of each."""
    validities: tuple[Validity, ...]
    """All columns of validity; a sample of AOI names is lost if none of them says valid."""


def parse_columns(text: str, header: Sequence[str]) -> ColumnMap:
    """Return the columns of a table with this header. Raise :class:`InvalidSettings` for a text that is not a map."""
    said = _items(text)
    time, time_unit = _with_unit("t", said, tuple(TIME_UNITS), header)
    columns = {"t": time}
    units = {}
    for field in POSITIONS:
        if field in said:
            columns[field], units[field] = _with_unit(field, said, POSITION_UNITS, header)
    if len(set(units.values())) > 1:
        raise InvalidSettings(
            f"--columns: positions are in {', '.join(sorted(set(units.values())))}: give them one unit"
        )
    for field in (*EYES, "aoi"):
        if field in said:
            columns[field] = _known(field, said[field], header)
    validities = {field: _validity(field, said[field], header) for field in VALIDITIES if field in said}
    points = _points(validities, columns)
    if not points and "aoi" not in columns:
        raise InvalidSettings(f"--columns needs x and y, or aoi, such as {EXAMPLE}")
    unit = next(iter(units.values()), "")
    return ColumnMap(columns, TIME_UNITS[time_unit], unit, points, tuple(validities.values()))


def _items(text: str) -> dict[str, str]:
    """Return the text of each field."""
    starts = list(_ITEM.finditer(text))
    if not starts or starts[0].start() != 0:
        raise InvalidSettings(f"--columns is {text!r}: write FIELD=COLUMN:UNIT with commas between, such as {EXAMPLE}")
    ends = [match.start() for match in starts[1:]] + [len(text)]
    said: dict[str, str] = {}
    for match, end in zip(starts, ends, strict=True):
        field = match[1]
        if field not in FIELDS:
            raise InvalidSettings(f"--columns: {field!r} is none of {', '.join(FIELDS)}{did_you_mean(field, FIELDS)}")
        if field in said:
            raise InvalidSettings(f"--columns: {field} is given twice")
        said[field] = text[match.end() : end].strip()
    return said


def _with_unit(field: str, said: dict[str, str], units: tuple[str, ...], header: Sequence[str]) -> tuple[str, str]:
    """Return column and unit of a field that needs one."""
    if field not in said:
        raise InvalidSettings(f"--columns needs {field}, such as {EXAMPLE}")
    column, _, unit = (part.strip() for part in said[field].rpartition(":"))
    if unit not in units or not column:
        raise InvalidSettings(
            f"--columns: {field}={said[field]} does not end in a unit: write {field}=COLUMN: and one of "
            f"{', '.join(units)}" + (did_you_mean(unit, units) if column else "")
        )
    return _known(field, column, header), unit


def _known(field: str, column: str, header: Sequence[str]) -> str:
    """Return the column. Raise :class:`InvalidSettings` with the table's columns if it has no such column."""
    if column not in header:
        raise InvalidSettings(
            f"--columns: the table has no column {column!r} for {field}; it has {', '.join(header)}"
            f"{did_you_mean(column, header)}"
        )
    return column


def _points(
    validities: dict[str, Validity], columns: dict[str, str]
) -> tuple[tuple[str, str, Validity | None], ...]:  # fmt: skip
    found = []
    for side in ("", "left_", "right_"):
        x, y, valid = f"{side}x", f"{side}y", f"{side}valid"
        if (x in columns) != (y in columns):
            raise InvalidSettings(f"--columns needs {x} and {y} together, such as {EXAMPLE}")
        if x in columns:
            found.append((columns[x], columns[y], validities.get(valid)))
        elif valid in validities and (side or columns.keys() & set(POSITIONS)):
            raise InvalidSettings(f"--columns: {valid} needs {x} and {y}")
    if "x" in columns and len(found) > 1:
        raise InvalidSettings("--columns: give either x and y, or left_x, left_y, right_x and right_y")
    return tuple(found)


def _validity(field: str, text: str, header: Sequence[str]) -> Validity:
    if text in header:
        return Validity(text, ())
    column, _, values = (part.strip() for part in text.rpartition(":"))
    return Validity(_known(field, column or text, header), tuple(v.strip() for v in values.split("|") if v.strip()))
