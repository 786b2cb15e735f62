"""Text of SMI (IDF converter and BeGaze): microseconds, each eye's position in pixels, 0 and 0 is lost.

Remarks before the table (``##``) say the size of the screen (``Calibration Area``); without it, ``--screen`` is needed.
Nothing else of them is read, such as the subject's name. Rows of type SMP are samples and rows of type MSG messages;
rows of other types are skipped. An eye that blinks (``L Event Info``) is lost. Pupil sizes are in mm where the table
has them, else in the eye camera's pixels.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import NamedTuple

from shift_schemas.errors import InvalidSettings

from shift_sources.files.options import Options, ScreenSize
from shift_sources.files.samples import Eyes, Gaze, Sample, sample_of_eyes, since_first
from shift_sources.files.table import Header, Reader, Row, cells_of, check_screen, refuse_names
from shift_sources.files.text_file import TextFile

MICROSECONDS = 1e6
AREA = re.compile(r"## Calibration Area:\s*(\d+)\s+(\d+)")
TIME, TYPE = "Time", "Type"
SAMPLE, MESSAGE = "SMP", "MSG"
PUPILS = ("{} Mapped Diameter [mm]", "{} Pupil Diameter [mm]", "{} Dia [mm]", "{} Dia X [px]")
"""The columns of a pupil's size, the best ones first."""
SIDES = {"L": "left", "R": "right"}
Event = tuple[float, Sample | str]


class _Eye(NamedTuple):
    """The columns of one eye."""

    side: str
    x: str
    y: str
    pupil: str
    """Empty: the table has none."""
    event: str
    """The column that names a blink; empty: the table has none."""


def _eyes(columns: set[str]) -> tuple[_Eye, ...]:
    found = []
    for letter, side in SIDES.items():
        x, y = f"{letter} POR X [px]", f"{letter} POR Y [px]"
        if {x, y} <= columns:
            pupil = next((name for p in PUPILS if (name := p.format(letter)) in columns), "")
            event = f"{letter} Event Info"
            found.append(_Eye(side, x, y, pupil, event if event in columns else ""))
    return tuple(found)


def _events(file: TextFile, header_line: int, header: Header, screen: ScreenSize) -> Iterator[Event]:
    eyes = _eyes(set(header.columns))
    before = -1.0
    for number, line in file.lines():
        if number <= header_line or not line.strip() or line.startswith("#"):
            continue
        cells = cells_of(line, "\t")
        kind = cells[header.columns[TYPE]] if len(cells) > header.columns[TYPE] else ""
        if kind not in (SAMPLE, MESSAGE):
            if not re.match(r"\d+\t[A-Za-z]", line):
                raise file.wrong(number, "row", line.strip(), "time and type, then the columns of the header")
            continue
        row = Row(file.name, number, header, _padded(cells, header.width))
        time = row.ticks(TIME)
        if time is None or time < before:
            raise row.wrong(TIME, "microseconds, rising from row to row")
        if kind == MESSAGE:
            yield time, " ".join(cells[3:]).strip().removeprefix("# Message:").strip()
        elif time > before:
            before = time
            yield time, _sample(row, eyes, screen)


def _padded(cells: list[str], width: int) -> list[str]:
    """Return as many cells as the header has: a row may lack the last ones, and end in a tab."""
    return (cells + [""] * width)[:width]


def _sample(row: Row, eyes: tuple[_Eye, ...], screen: ScreenSize) -> Sample:
    points: list[tuple[float, float]] = []
    pupils: dict[str, float | None] = {}
    for eye in eyes:
        x, y = row.number(eye.x), row.number(eye.y)
        pupils[f"pupil_{eye.side}"] = row.size(eye.pupil)
        blinks = eye.event != "" and row.text(eye.event) == "Blink"
        if x is not None and y is not None and (x, y) != (0, 0) and not blinks:
            points.append((x / screen.width, y / screen.height))
    return sample_of_eyes(0.0, points, Eyes(**pupils))


def _read(file: TextFile, options: Options) -> Gaze | None:
    screen = options.screen
    for number, line in enumerate(file.head, start=1):
        if area := AREA.match(line):
            screen = ScreenSize(int(area[1]), int(area[2]))
        names = cells_of(line, "\t")
        if names[:2] == [TIME, TYPE] and _eyes(set(names)):
            refuse_names(file.name, "SMI", options)
            if screen is None or not screen.width or not screen.height:
                raise InvalidSettings(
                    f"{file.name} (SMI) has positions in pixels and no Calibration Area: give the size of the screen "
                    "with --screen, such as --screen 1920x1080"
                )
            check_screen(file.name, screen, options)
            return Gaze(since_first(_events(file, number, Header(names), screen), MICROSECONDS))
    return None


FORMATS: dict[str, tuple[Reader, ...]] = {"smi": (_read,)}
