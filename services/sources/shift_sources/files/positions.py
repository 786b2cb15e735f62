"""Conversion of positions to 0..1 from the upper left corner of the stimulus. Pure."""

from __future__ import annotations

import math

from shift_sources.files.options import Millimetres, Origin

Point = tuple[float, float]


def from_upper_left(x: float, y: float, origin: Origin) -> Point:
    """Return a position in widths and heights of the stimulus from its upper left corner."""
    if origin is Origin.BOTTOM_LEFT:
        return x, 1 - y
    if origin is Origin.CENTRE:
        return 0.5 + x, 0.5 - y
    if origin is Origin.CENTRE_DOWN:
        return 0.5 + x, 0.5 + y
    return x, y


def from_degrees(x: float, y: float, size: Millimetres, distance_mm: float) -> Point:
    """Return degrees of visual angle from the stimulus's centre in widths and heights from there.

    The eyes are straight in front of the centre: an angle ``a`` is ``distance * tan(a)`` away from it.
    """
    return (
        distance_mm * math.tan(math.radians(x)) / size.width,
        distance_mm * math.tan(math.radians(y)) / size.height,
    )
