"""Raw data of SMI BeGaze: a table with ``RecordingTime [ms]`` and ``Point of Regard .. X [px]`` of both eyes or each.

Positions are in pixels of ``--screen``. A cell with ``-`` is lost, and so is 0 and 0, and an eye of the category Blink.
Rows of other groups of categories than Eye, such as messages, are skipped. ``AOI Name ..`` names the AOI of an eye; the
first of the table's eyes that is on one counts. Lines before the table, and the participant's name, are not read.
"""

from __future__ import annotations

from functools import partial

from shift_sources.files.aoi_names import study_name
from shift_sources.files.options import Options, ScreenSize
from shift_sources.files.samples import Eyes, Gaze, Sample, named_sample, sample_of_eyes
from shift_sources.files.table import SEPARATORS, Reader, Row, TableFormat, cells_of, gaze_of_table
from shift_sources.files.text_file import TextFile

TIME = "RecordingTime [ms]"
MILLISECONDS = 1e3
GROUP, OF_EYES = "Category Group", "Eye"
BOTH, SIDES = "Binocular", ("Left", "Right")
NOTHING = frozenset({"", "-", "White Space"})
"""What a cell has where there is no value, and where gaze is on no AOI."""


def _columns(side: str) -> tuple[str, str]:
    return f"Point of Regard {side} X [px]", f"Point of Regard {side} Y [px]"


def _value(row: Row, column: str) -> float | None:
    return None if row.text(column) in NOTHING else row.number(column)


def _seen(row: Row, side: str) -> tuple[float, float] | None:
    x, y = (_value(row, column) for column in _columns(side))
    category = f"Category {side}"
    blinks = category in row.columns and row.text(category) == "Blink"
    return None if x is None or y is None or (x, y) == (0, 0) or blinks else (x, y)


def _pupils(row: Row) -> Eyes:
    names = [f"Pupil Diameter {side} [mm]" for side in SIDES]
    sizes = [_value(row, name) if name in row.columns else None for name in names]
    return Eyes(*(size if size is not None and size > 0 else None for size in sizes))


def _is_sample(row: Row) -> bool:
    return GROUP not in row.columns or row.text(GROUP) in (OF_EYES, *NOTHING)


def _point(t: float, row: Row, sides: tuple[str, ...], screen: ScreenSize) -> Sample | None:
    if not _is_sample(row):
        return None
    points = [point for side in sides if (point := _seen(row, side)) is not None]
    return sample_of_eyes(t, [(x / screen.width, y / screen.height) for x, y in points], _pupils(row))


def _name(t: float, row: Row, sides: tuple[str, ...], aois: tuple[str, ...], options: Options) -> Sample | None:
    if not _is_sample(row):
        return None
    names = (_aoi(row, column, options) for column in aois)
    tracked = not sides or any(_seen(row, side) is not None for side in sides)
    return named_sample(t, next((name for name in names if name is not None), None), tracked, _pupils(row))


def _aoi(row: Row, column: str, options: Options) -> str | None:
    text = row.text(column)
    return None if text in NOTHING else study_name(text, options, lambda rule: row.wrong(column, rule))


def _recognise(header: list[str], options: Options, separator: str) -> TableFormat | None:
    there = tuple(side for side in (BOTH, *SIDES) if set(_columns(side)) <= set(header))
    sides = there[:1] if BOTH in there else there
    aois = tuple(name for side in (BOTH, *SIDES) if (name := f"AOI Name {side}") in header)
    if TIME not in header or not (sides or aois):
        return None
    named = bool(aois) and (options.named or not sides)
    screen = options.screen or ScreenSize(1, 1)
    sample = (
        partial(_name, sides=sides, aois=aois, options=options)
        if named
        else partial(_point, sides=sides, screen=screen)
    )
    return TableFormat(
        "SMI BeGaze", TIME, (TIME,), sample, MILLISECONDS, separator, repeats=True, decimal_comma=separator != ",",
        pixels=not named, named=named,
    )  # fmt: skip


def _read(file: TextFile, options: Options) -> Gaze | None:
    for number, line in enumerate(file.head, start=1):
        if TIME not in line:
            continue
        for separator in SEPARATORS:
            header = cells_of(line, separator)
            if (table := _recognise(header, options, separator)) is not None:
                return gaze_of_table(file, table, header, options, number)
    return None


FORMATS: dict[str, tuple[Reader, ...]] = {"begaze": (_read,)}
