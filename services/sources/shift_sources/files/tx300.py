"""Tables of the Tobii TX300: microseconds, 0..1 from the upper left corner, a validity of 0..4 for each eye."""

from __future__ import annotations

from shift_sources.files.samples import Sample, sample_of_eyes
from shift_sources.files.table import Row, TableFormat, is_table

LOST = -1.0
"""What a TX300 writes for a lost coordinate."""
LARGEST_VALIDITY = 1.0
"""0 certain, 1 probable, 2 unsure which eye, 3 probably the other, 4 not found (Tobii's manual)."""
EYES = (("LGazePos2dx", "LGazePos2dy", "LValidity"), ("RGazePos2dx", "RGazePos2dy", "RValidity"))
"""The columns of x, y and validity for each eye."""


def _sample(t: float, row: Row) -> Sample:
    points = []
    for x_column, y_column, validity in EYES:
        x, y = row.number(x_column), row.number(y_column)
        if _is_certain(row, validity) and x is not None and y is not None and LOST not in (x, y):
            points.append((x, y))
    return sample_of_eyes(t, points)


def _is_certain(row: Row, column: str) -> bool:
    value = row.number(column)
    if value is not None and not 0 <= value <= 4:
        raise row.wrong(column, "0 (certain) to 4 (not found)")
    return value is not None and value <= LARGEST_VALIDITY


FORMATS = {
    "tx300": (is_table(TableFormat("Tobii TX300", "Time", ("Time", *(c for eye in EYES for c in eye)), _sample)),)
}
