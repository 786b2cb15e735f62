"""Tables of Titta: microseconds, 0..1 from the upper left corner, a validity of yes or no for each eye.

Older versions of Titta call the validity ``..._validity``. The tracker's own clock (``device_time_stamp``) is used if
the table has it, and the computer's clock otherwise. Pupil sizes and eye openness, the lids' distance, are in mm.
"""

from __future__ import annotations

from functools import partial

from shift_sources.files.samples import Eyes, Sample, sample_of_eyes
from shift_sources.files.table import Row, TableFormat, is_table

YES, NO = frozenset({"true", "1", "1.0"}), frozenset({"false", "0", "0.0", ""})
SIDES = ("left", "right")
VALIDITIES = ("valid", "validity")
OPENNESS = ("_diameter", "")
"""How versions of Titta end the name of the column of openness."""
Eye = tuple[str, str, str]
"""The columns of x, y and validity of one eye."""


def _sample(t: float, row: Row, eyes: tuple[Eye, Eye]) -> Sample:
    points = []
    for x_column, y_column, validity in eyes:
        x, y = row.number(x_column), row.number(y_column)
        if _is_yes(row, validity) and x is not None and y is not None:
            points.append((x, y))
    return sample_of_eyes(t, points, _eyes(row))


def _eyes(row: Row) -> Eyes:
    pupils = [row.size(f"{eye}_pupil_diameter") if _is_there(row, f"{eye}_pupil") else None for eye in SIDES]
    openness = [
        next((row.openness(name) for end in OPENNESS if (name := f"{eye}_eye_openness{end}") in row.columns), None)
        if _is_there(row, f"{eye}_eye_openness")
        else None
        for eye in SIDES
    ]
    return Eyes(*pupils, *openness)


def _is_there(row: Row, what: str) -> bool:
    """Return whether a value is valid, as far as the table says so."""
    return all(_is_yes(row, name) for end in VALIDITIES if (name := f"{what}_{end}") in row.columns)


def _is_yes(row: Row, column: str) -> bool:
    text = row.text(column).lower()
    if text not in YES | NO:
        raise row.wrong(column, "True or False, 1 or 0")
    return text in YES


def _format(time_column: str, validity: str, separator: str) -> TableFormat:
    point = "gaze_point_on_display_area"
    left, right = ((f"{e}_{point}_x", f"{e}_{point}_y", f"{e}_{validity}") for e in SIDES)
    columns = (time_column, *left, *right)
    return TableFormat("Titta", time_column, columns, partial(_sample, eyes=(left, right)), separator=separator)


FORMATS = {
    "titta": tuple(
        is_table(_format(time_column, validity, separator))
        for time_column in ("device_time_stamp", "system_time_stamp")
        for validity in ("gaze_point_valid", "gaze_point_validity")
        for separator in ("\t", ",")
    )
}
