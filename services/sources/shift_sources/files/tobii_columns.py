"""The columns of a Tobii table: their names say the eye, the axis and, in brackets, the unit. Pure.

Pro Lab writes ``Gaze point left X [DACS px]``, ``Pupil diameter left [mm]``; Studio ``GazePointLeftX (ADCSpx)``,
``PupilLeft``. Both eyes' common point is used if the table has it, and each eye's own otherwise.
"""

from __future__ import annotations

import re
from typing import NamedTuple

from shift_schemas.errors import InvalidSettings

from shift_sources.files.options import TIME_UNITS, Options

TICKS = {**TIME_UNITS, "μs": 1e6, "µs": 1e6}
UNIT = r"(?: ?[\[(](?P<unit>[^])]+)[\])])?"
TIME = re.compile(r"(Recording timestamp|RecordingTimestamp|EyeTrackerTimestamp)(?: \[(?P<unit>[^]]+)\])?")
STUDIO_TIME = "RecordingTimestamp"
"""Tobii Studio's time, in milliseconds."""
POINT = re.compile(r"Gaze ?[Pp]oint ?(?P<eye>[Ll]eft|[Rr]ight)? ?(?P<axis>[XY])" + UNIT)
PUPIL = re.compile(r"Pupil ?(?:diameter )?(?P<eye>[Ll]eft|[Rr]ight)" + UNIT)
OPENNESS = re.compile(r"Eye ?[Oo]penness ?(?P<eye>[Ll]eft|[Rr]ight)" + UNIT)
VALIDITY = re.compile(r"Validity ?(?P<eye>[Ll]eft|[Rr]ight)")
BOTH, LEFT, RIGHT = "", "left", "right"
KINDS = ("norm", "px", "mm")
"""Kinds of units, the best ones first."""


class PointColumns(NamedTuple):
    """The columns of one point of gaze."""

    x: str
    y: str
    validities: tuple[str, ...]


class TobiiColumns(NamedTuple):
    """What a table has."""

    time: str
    ticks: float
    points: tuple[PointColumns, ...]
    """Of both eyes together, or of each; empty: none."""
    kind: str
    """norm, px or mm."""
    validities: tuple[str, ...]
    pupils: tuple[str, str]
    """Left and right; a column that the table does not have is empty."""
    openness: tuple[str, str]


def find_columns(header: list[str], options: Options) -> TobiiColumns | None:
    """Return the columns of a Tobii table; None if it has no time that can be read.

    Millimetres are used instead of pixels if only they can be converted. Raise :class:`InvalidSettings` if positions
    are in a unit that nothing can convert.
    """
    times = [(name, found) for name in header if (found := TIME.fullmatch(name))]
    if not times:
        return None
    time, said = times[0]
    unit = said["unit"] or options.time_unit or ("ms" if time == STUDIO_TIME else "us")
    if unit not in TICKS:
        return None
    validities = {found["eye"].lower(): name for name in header if (found := VALIDITY.fullmatch(name))}
    only_mm = options.screen is None and options.screen_mm is not None
    points, kind = _points(header, validities, ("norm", "mm", "px") if only_mm else KINDS)
    pupils, openness = (_of_eyes(header, pattern) for pattern in (PUPIL, OPENNESS))
    return TobiiColumns(time, TICKS[unit], points, kind, tuple(validities.values()), pupils, openness)


def _points(
    header: list[str], validities: dict[str, str], kinds: tuple[str, ...]
) -> tuple[tuple[PointColumns, ...], str]:  # fmt: skip
    """Return the columns of the points in the best unit, and its kind."""
    found: dict[tuple[str, str], dict[str, str]] = {}
    """By unit and eye: the column of each axis."""
    for name in header:
        if match := POINT.fullmatch(name):
            unit, eye = match["unit"] or "px", (match["eye"] or BOTH).lower()
            found.setdefault((unit, eye), {}).setdefault(match["axis"], name)
    whole = {key: axes for key, axes in found.items() if len(axes) == 2}
    units = list(dict.fromkeys(unit for unit, _ in whole))
    for eyes in ((BOTH,), (LEFT, RIGHT)):
        for kind in kinds:
            for unit in units:
                there = [eye for eye in eyes if (unit, eye) in whole]
                if there and unit.endswith(kind):
                    return tuple(_of_eye(whole[unit, eye], eye, validities) for eye in there), kind
    if whole:
        column = next(iter(whole.values()))["X"]
        raise InvalidSettings(
            f"the column {column} of the Tobii table is in {', '.join(units)}: export the gaze point in pixels or "
            "normalised, since the size of the stimulus in other units is not in the file"
        )
    return (), ""


def _of_eye(axes: dict[str, str], eye: str, validities: dict[str, str]) -> PointColumns:
    own = tuple(validities.values()) if eye == BOTH else tuple(name for e, name in validities.items() if e == eye)
    return PointColumns(axes["X"], axes["Y"], own)


def _of_eyes(header: list[str], pattern: re.Pattern[str]) -> tuple[str, str]:
    names: dict[str, str] = {}
    for name in header:
        if match := pattern.fullmatch(name):
            names.setdefault(match["eye"].lower(), name)
    return names.get(LEFT, ""), names.get(RIGHT, "")
