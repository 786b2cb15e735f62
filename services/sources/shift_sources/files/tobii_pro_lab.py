"""Tables of Tobii Pro Lab and Tobii Studio (TSV), also in UTF-16 and with decimal commas.

The header says the unit in brackets where it does (``Recording timestamp [ms]``, ``Gaze point X [DACS px]``). Without a
unit the time is in microseconds (Pro Lab) or milliseconds (Studio), or in ``--time-unit``, since older versions of Pro
Lab write milliseconds; and positions are in pixels. Positions in
millimetres need ``--screen-mm``; those of Studio (``ADCSmm``) need ``--origin`` too, since the file does not say where
they begin. Rows of other sensors and rows of events are no samples. A table of several recordings needs
``--recording``. Names of participants are not read.
"""

from __future__ import annotations

import re
from functools import partial

from shift_schemas.errors import InvalidSettings

from shift_sources.files.options import Options, Origin
from shift_sources.files.positions import Point, from_upper_left
from shift_sources.files.recordings import OneRecording
from shift_sources.files.samples import Eyes, Sample, named_sample, sample_of_eyes
from shift_sources.files.table import Row, TableFormat, table_reader
from shift_sources.files.tobii_aois import aoi_hit, hit_columns
from shift_sources.files.tobii_columns import PointColumns, TobiiColumns, find_columns

VALID = frozenset({"valid", "0", "1"})
"""Pro Lab writes Valid and Invalid. Studio writes 0 (certain) to 4 (not found) in ``ValidityLeft``."""
INVALID = frozenset({"invalid", "2", "3", "4", ""})
RECORDINGS = ("Recording name", "RecordingName")
EYE_TRACKER = "eye tracker"
MOVEMENT = "Eye movement type"
NOT_FOUND = re.compile("EyesNotFound")
"""What Pro Lab calls the movement of eyes that it did not find: EyesNotFound or EyesNotFoundMovement."""


def _point(t: float, row: Row, columns: TobiiColumns, convert: partial[Point]) -> Sample | None:
    if _is_other_sensor(row) or (_is_event(row) and not any(row.text(eye.x) for eye in columns.points)):
        return None
    points = [point for eye in columns.points if (point := _seen(row, eye)) is not None]
    return sample_of_eyes(t, [convert(*point) for point in points], _eyes(row, columns))


def _name(t: float, row: Row, columns: TobiiColumns, hits: tuple[str, ...], options: Options) -> Sample | None:
    if _is_other_sensor(row) or (_is_event(row) and not _sensor(row)):
        return None
    if MOVEMENT in row.columns and NOT_FOUND.match(row.text(MOVEMENT)):
        tracked = False
    elif columns.points:
        tracked = any(_seen(row, eye) is not None for eye in columns.points)
    else:
        tracked = _is_valid(row, columns.validities)
    return named_sample(t, aoi_hit(row, hits, options), tracked, _eyes(row, columns))


def _seen(row: Row, eye: PointColumns) -> Point | None:
    x, y, valid = row.number(eye.x), row.number(eye.y), _is_valid(row, eye.validities)
    return None if x is None or y is None or not valid else (x, y)


def _is_valid(row: Row, validities: tuple[str, ...]) -> bool:
    for name in validities:
        if row.text(name).lower() not in VALID | INVALID:
            raise row.wrong(name, "Valid or Invalid, or 0 (certain) to 4 (not found)")
    return not validities or any(row.text(name).lower() in VALID for name in validities)


def _sensor(row: Row) -> str:
    return row.text("Sensor").lower() if "Sensor" in row.columns else ""


def _is_other_sensor(row: Row) -> bool:
    return _sensor(row) not in ("", EYE_TRACKER)


def _is_event(row: Row) -> bool:
    return "Event" in row.columns and row.text("Event") != ""


def _eyes(row: Row, columns: TobiiColumns) -> Eyes:
    left, right = (row.size(column) for column in columns.pupils)
    return Eyes(left, right, *(row.openness(column) for column in columns.openness))


def _conversion(columns: TobiiColumns, options: Options) -> partial[Point] | None:
    """Return the conversion to 0..1, or None while the size in pixels is missing, which the table's reader asks for."""
    origin = Origin.TOP_LEFT
    width, height = 1.0, 1.0
    if columns.kind == "px":
        if options.screen is None:
            return None
        width, height = options.screen.width, options.screen.height
    elif columns.kind == "mm":
        if options.screen_mm is None:
            raise InvalidSettings(
                f"the column {columns.points[0].x} of the Tobii table is in mm: export the gaze point in pixels or "
                "normalised, or give the size of the stimulus in millimetres with --screen-mm, such as 509x286"
            )
        if options.origin is None and "ADCS" in columns.points[0].x:
            raise InvalidSettings(
                f"the column {columns.points[0].x} of the Tobii table does not say where its positions begin: give "
                "--origin bottom-left or --origin top-left"
            )
        width, height = options.screen_mm.width, options.screen_mm.height
        origin = options.origin or origin
    return partial(_converted, width=width, height=height, origin=origin)


def _converted(x: float, y: float, width: float, height: float, origin: Origin) -> Point:
    return from_upper_left(x / width, y / height, origin)


def _recognise(header: list[str], options: Options) -> TableFormat | None:
    columns, hits = find_columns(header, options), hit_columns(header)
    if columns is None or not (columns.points or hits):
        return None
    taken = OneRecording(RECORDINGS, options.recording)
    named = bool(hits) and (options.named or not columns.points)
    if named:
        names = partial(_name, columns=columns, hits=hits, options=options)
        return TableFormat(
            "Tobii", columns.time, (columns.time, *hits), names, columns.ticks, repeats=True, decimal_comma=True,
            named=True, taken=taken,
        )  # fmt: skip
    convert = _conversion(columns, options) or partial(_converted, width=1, height=1, origin=Origin.TOP_LEFT)
    points = partial(_point, columns=columns, convert=convert)
    return TableFormat(
        "Tobii", columns.time, (columns.time, columns.points[0].x), points, columns.ticks, repeats=True,
        decimal_comma=True, pixels=columns.kind == "px", taken=taken,
    )  # fmt: skip


FORMATS = {"tobii": (table_reader(_recognise),)}
