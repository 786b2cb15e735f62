"""Tables of Pupil Labs Neon and Invisible (Pupil Cloud): nanoseconds in UTC.

``gaze.csv`` is gaze in the scene camera's picture, in pixels from the upper left corner; the picture of Neon has 1600 x
1200 pixels, that of Invisible 1088 x 1080. The table of a marker mapper or of a surface is 0..1 on the surface, from
the upper left corner; with ``--aoi``, the surface is an AOI. Pupil sizes are in ``3d_eye_states.csv``, and who wore the
glasses is in other files, which are not read.
"""

from __future__ import annotations

from functools import partial

from shift_sources.files.options import Options, ScreenSize
from shift_sources.files.recordings import OneRecording
from shift_sources.files.samples import Sample, lost_sample, named_sample
from shift_sources.files.surface_names import surface_name
from shift_sources.files.table import Row, TableFormat, table_reader

NANOSECONDS = 1e9
RECORDING = "recording id"
TIME = "timestamp [ns]"
PIXELS = ("gaze x [px]", "gaze y [px]")
SURFACE = ("gaze position on surface x [normalized]", "gaze position on surface y [normalized]")
DETECTED = "gaze detected on surface"
YES = frozenset({"true", "1", "1.0"})


def _in_pixels(t: float, row: Row, screen: ScreenSize | None) -> Sample:
    x, y = (row.number(column) for column in PIXELS)
    worn = "worn" not in row.columns or row.text("worn").lower() in YES
    if x is None or y is None or not worn or screen is None or _blinks(row):
        return lost_sample(t)
    return Sample(t, x / screen.width, y / screen.height, True)


def _blinks(row: Row) -> bool:
    return "blink id" in row.columns and row.text("blink id") != ""


def _on_surface(t: float, row: Row) -> Sample:
    x, y = (row.number(column) for column in SURFACE)
    if x is None or y is None or row.text(DETECTED).lower() not in YES:
        return lost_sample(t)
    return Sample(t, x, y, True)


def _name(t: float, row: Row, options: Options) -> Sample:
    tracked = not _blinks(row)
    on_it = tracked and row.text(DETECTED).lower() in YES
    return named_sample(t, surface_name(row, options) if on_it else None, tracked)


def _recognise_pixels(header: list[str], options: Options) -> TableFormat | None:
    if not {TIME, *PIXELS} <= set(header):
        return None
    sample = partial(_in_pixels, screen=options.screen)
    return TableFormat(
        "Neon", TIME, (TIME, *PIXELS), sample, ticks=NANOSECONDS, separator=",", pixels=True,
        taken=OneRecording([RECORDING], options.recording),
    )  # fmt: skip


def _recognise_surface(header: list[str], options: Options) -> TableFormat | None:
    columns = (TIME, *SURFACE, DETECTED)
    if not set(columns) <= set(header):
        return None
    sample = partial(_name, options=options) if options.named else _on_surface
    return TableFormat(
        "Neon surface", TIME, columns, sample, ticks=NANOSECONDS, separator=",", named=options.named,
        taken=OneRecording([RECORDING], options.recording),
    )  # fmt: skip


FORMATS = {"neon": (table_reader(_recognise_pixels),), "neon-surface": (table_reader(_recognise_surface),)}
