"""What the command line says about a gaze file, beside the file itself: sizes, origin and names. Pure.

A size, a unit or an origin that neither the file nor the command line says is asked for in a sentence, never assumed.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from shift_schemas.errors import InvalidSettings
from shift_schemas.ids import is_id, not_an_id
from shift_schemas.suggestions import did_you_mean

TIME_UNITS = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}
"""Units of a time, with their number in a second."""


@dataclass(frozen=True)
class ScreenSize:
    """The size of the screen, or of the scene camera's picture, in pixels."""

    width: int
    height: int

    def __str__(self) -> str:
        return f"{self.width}x{self.height}"


@dataclass(frozen=True)
class Millimetres:
    """The size of the stimulus in millimetres."""

    width: float
    height: float


class Origin(StrEnum):
    """Where a file's positions have their zero point, and the direction of y."""

    TOP_LEFT = "top-left"
    """y downwards."""
    BOTTOM_LEFT = "bottom-left"
    """y upwards."""
    CENTRE = "centre"
    """y upwards."""
    CENTRE_DOWN = "centre-down"
    """y downwards."""


@dataclass(frozen=True)
class Options:
    """What the command line says about a file; each reader takes what its format needs."""

    screen: ScreenSize | None = None
    screen_mm: Millimetres | None = None
    distance_mm: float | None = None
    """From the eyes to the stimulus; needed for degrees."""
    origin: Origin | None = None
    """None: the format's own."""
    time_unit: str = ""
    """ms, us or s: of a time whose unit the file does not say; empty: the format's own."""
    named: bool = False
    """Whether AOI names are taken instead of points, where the file has both."""
    aoi_map: Mapping[str, str] = field(default_factory=dict)
    """The study's name of each AOI of the file that is called otherwise; empty: not an AOI of the study."""
    recording: str = ""
    """The recording that is taken from a file with several; a part of its id is enough."""
    columns: str = ""
    """The map of the columns of a table that has no format of its own, see ``mapped_columns``."""
    lost: tuple[str, ...] = ()
    """Texts and numbers that mean a lost value, in a table with mapped columns."""


def millimetres_of(text: str) -> Millimetres | None:
    """Return the size of a text such as ``509x286.5``; None for an empty one. Raise :class:`InvalidSettings`."""
    if not text:
        return None
    match = re.fullmatch(r"\s*(\d{1,5}(?:\.\d+)?)\s*[xX×]\s*(\d{1,5}(?:\.\d+)?)\s*", text)
    if match is None or not float(match[1]) or not float(match[2]):
        raise InvalidSettings(f"--screen-mm is {text!r}: write width and height in millimetres, such as 509x286")
    return Millimetres(float(match[1]), float(match[2]))


def origin_of(text: str) -> Origin | None:
    """Return the origin of that name; None for an empty text. Raise :class:`InvalidSettings`."""
    if not text:
        return None
    try:
        return Origin(text)
    except ValueError:
        known = [origin.value for origin in Origin]
        raise InvalidSettings(f"--origin is {text!r}: write {', '.join(known)}{did_you_mean(text, known)}") from None


def time_unit_of(text: str) -> str:
    """Return the unit. Raise :class:`InvalidSettings` for a text that is not one."""
    if text not in ("", *TIME_UNITS):
        raise InvalidSettings(f"--time-unit is {text!r}: write {', '.join(TIME_UNITS)}{did_you_mean(text, TIME_UNITS)}")
    return text


def aoi_map_of(pairs: Iterable[str]) -> dict[str, str]:
    """Return the map of texts such as ``AOI 1=cup``. Raise :class:`InvalidSettings` for another text."""
    names = {}
    for pair in pairs:
        given, equals, name = (part.strip() for part in pair.rpartition("="))
        if not equals or not given:
            raise InvalidSettings(
                f"--aoi-map is {pair!r}: write the file's name, = and the study's, such as 'AOI 1=cup'"
            )
        if name and not is_id(name):
            raise InvalidSettings(f"--aoi-map {pair!r}: {not_an_id(name)}")
        names[given] = name
    return names


def lost_of(text: str) -> tuple[str, ...]:
    """Return the values of a text such as ``-1,9999``."""
    return tuple(value.strip() for value in text.split(",") if value.strip())
