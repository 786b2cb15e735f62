"""Tables of Pupil Labs Neon and Invisible (Pupil Cloud): nanoseconds in UTC.

``gaze.csv`` is gaze in the scene camera's picture, in pixels from the upper left corner; the picture of Neon has 1600 x
1200 pixels, that of Invisible 1088 x 1080. The table of a marker mapper or of a surface is 0..1 on the surface, from
the upper left corner. Who wore the glasses stands in other files, which are not read.
"""

from __future__ import annotations

from shift_sources.files.samples import Sample
from shift_sources.files.table import Recogniser, Row, ScreenSize, TableFormat, is_table

NANOSECONDS = 1e9
TIME = "timestamp [ns]"
PIXELS = ("gaze x [px]", "gaze y [px]")
SURFACE = ("gaze position on surface x [normalized]", "gaze position on surface y [normalized]")
DETECTED = "gaze detected on surface"
YES = frozenset({"true", "1", "1.0"})


def _in_pixels(screen: ScreenSize | None) -> TableFormat:
    def sample(t: float, row: Row) -> Sample:
        x, y = (row.number(column) for column in PIXELS)
        worn = "worn" not in row.columns or row.text("worn").lower() in YES
        if x is None or y is None or not worn or screen is None or _blinks(row):
            return Sample(t, None, None, False)
        return Sample(t, x / screen.width, y / screen.height, True)

    return TableFormat("Neon", TIME, (TIME, *PIXELS), sample, ticks=NANOSECONDS, separator=",", pixels=True)


def _blinks(row: Row) -> bool:
    return "blink id" in row.columns and row.text("blink id") != ""


def _on_surface(t: float, row: Row) -> Sample:
    x, y = (row.number(column) for column in SURFACE)
    if x is None or y is None or row.text(DETECTED).lower() not in YES:
        return Sample(t, None, None, False)
    return Sample(t, x, y, True)


def _recognise_pixels(header: list[str], screen: ScreenSize | None) -> TableFormat | None:
    return _in_pixels(screen) if {TIME, *PIXELS} <= set(header) else None


_pixels: Recogniser = _recognise_pixels
FORMATS = {
    "neon": (_pixels,),
    "neon-surface": (
        is_table(
            TableFormat("Neon surface", TIME, (TIME, *SURFACE, DETECTED), _on_surface, ticks=NANOSECONDS, separator=",")
        ),
    ),
}
