"""Tables of Tobii Pro Lab and Tobii Studio (TSV), also in UTF-16 and with decimal commas.

The header says the unit in brackets where it does (``Recording timestamp [ms]``, ``Gaze point X [DACS px]``). Without a
unit the time is in microseconds (Pro Lab) or milliseconds (Studio), and positions are in pixels. Rows of other sensors
and rows of events are no samples. Names of participants and recordings are not read.
"""

from __future__ import annotations

import re
from functools import partial
from typing import NamedTuple

from shift_schemas.errors import InvalidSettings

from shift_sources.files.samples import Sample, sample_of_eyes
from shift_sources.files.table import Recogniser, Row, ScreenSize, TableFormat

TICKS = {"μs": 1e6, "µs": 1e6, "us": 1e6, "ms": 1e3, "s": 1.0}
TIME = re.compile(r"(Recording timestamp|RecordingTimestamp|EyeTrackerTimestamp)(?: \[(?P<unit>[^]]+)\])?")
STUDIO_TIME = "RecordingTimestamp"
"""Tobii Studio's time, in milliseconds."""
BOTH = (
    re.compile(r"(?:Gaze ?[Pp]oint ?X)(?: ?[\[(](?P<unit>[^])]+)[\])])?"),
    re.compile(r"(?:Gaze ?[Pp]oint ?Y)(?: ?[\[(](?P<unit>[^])]+)[\])])?"),
)
VALIDITY = ("Validity left", "Validity right")
VALID = frozenset({"valid", "0", "1"})
"""Pro Lab writes Valid and Invalid. Studio writes 0 (certain) to 4 (not found) in ``ValidityLeft``."""
EYE_TRACKER = "eye tracker"


class _Columns(NamedTuple):
    time: str
    ticks: float
    x: str
    y: str
    pixels: bool
    validities: tuple[str, ...]


def _kind(unit: str | None) -> str:
    """Return norm, px or mm of a unit such as ``DACS px`` and ``ADCSpx``; without one, positions are in pixels."""
    return next((kind for kind in ("norm", "px", "mm") if (unit or "px").endswith(kind)), unit or "px")


def _columns(header: list[str]) -> _Columns | None:
    times = [(name, found) for name in header if (found := TIME.fullmatch(name))]
    xs, ys = ([(n, found) for n in header if (found := pattern.fullmatch(n))] for pattern in BOTH)
    if not times or not xs or not ys:
        return None
    time, said = times[0]
    unit = said["unit"] or ("ms" if time == STUDIO_TIME else "us")
    by_unit, other = ({_kind(found["unit"]): name for name, found in columns} for columns in (xs, ys))
    usable = [kind for kind in ("norm", "px") if kind in by_unit and kind in other]
    if not usable:
        raise InvalidSettings(
            f"the column {xs[0][0]} of the Tobii table is in {', '.join(by_unit)}: export the gaze point in pixels or "
            "normalised, since the size of the stimulus in other units is not in the file"
        )
    position = usable[0]
    validities = tuple(n for n in header if n in VALIDITY or n in ("ValidityLeft", "ValidityRight"))
    if unit not in TICKS:
        return None
    return _Columns(time, TICKS[unit], by_unit[position], other[position], position == "px", validities)


def _sample(t: float, row: Row, columns: _Columns, screen: ScreenSize | None) -> Sample | None:
    if "Sensor" in row.columns and row.text("Sensor").lower() not in ("", EYE_TRACKER):
        return None
    if "Event" in row.columns and row.text("Event") and not row.text(columns.x):
        return None
    x, y = row.number(columns.x), row.number(columns.y)
    valid = not columns.validities or any(row.text(name).lower() in VALID for name in columns.validities)
    if x is None or y is None or not valid:
        return Sample(t, None, None, False)
    if columns.pixels:
        assert screen is not None
        x, y = x / screen.width, y / screen.height
    return sample_of_eyes(t, [(x, y)])


def _recognise(header: list[str], screen: ScreenSize | None) -> TableFormat | None:
    found = _columns(header)
    if found is None:
        return None
    sample = partial(_sample, columns=found, screen=screen)
    needed = (found.time, found.x, found.y)
    return TableFormat(
        "Tobii", found.time, needed, sample, ticks=found.ticks, repeats=True, decimal_comma=True, pixels=found.pixels
    )


_tobii: Recogniser = _recognise
FORMATS = {"tobii": (_tobii,)}
