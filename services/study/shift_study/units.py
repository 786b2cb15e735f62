"""Units in the names of a study's values: ``distance_cm`` is in cm. Pure."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

_UNITS: dict[str, tuple[str, float, str]] = {
    "um": ("length", 1e-4, "micrometres"), "mm": ("length", 0.1, "mm"), "cm": ("length", 1.0, "cm"),
    "m": ("length", 100.0, "m"), "in": ("length", 2.54, "inches"), "inch": ("length", 2.54, "inches"),
    "ns": ("time", 1e-9, "ns"), "us": ("time", 1e-6, "µs"), "ms": ("time", 1e-3, "ms"), "s": ("time", 1.0, "s"),
    "sec": ("time", 1.0, "s"), "min": ("time", 60.0, "minutes"),
    "deg": ("angle", 1.0, "degrees"), "rad": ("angle", 57.29577951308232, "rad"), "px": ("pixels", 1.0, "pixels"),
}  # fmt: skip
"""For each suffix: the quantity, the factor to its first unit (cm, s, degrees), and the unit's name."""


def unit_of(key: str) -> str | None:
    """Return the name of the unit at the end of a key, or None if it has none."""
    unit = _UNITS.get(key.rpartition("_")[2]) if "_" in key else None
    return unit[2] if unit else None


def converted(key: str, given: Any, known: Iterable[str]) -> str | None:
    """Return what to write for a key that differs from a known key only in its unit; None for any other key.

    ``distance_mm: 650`` gives "write 'distance_cm', in cm: 650 mm are 65 cm".
    """
    stem, _, suffix = key.lower().rpartition("_")
    meant = next((k for k in known if stem and k.rpartition("_")[0] == stem and unit_of(k)), None)
    if meant is None or suffix not in _UNITS:
        return None
    ours, theirs = _UNITS[meant.rpartition("_")[2]], _UNITS[suffix]
    said = f"write {meant!r}, in {ours[2]}"
    if ours[0] != theirs[0]:
        return f"{said}: {theirs[2]} cannot be converted, so measure it in {ours[2]}"
    if isinstance(given, (int, float)) and not isinstance(given, bool):
        return f"{said}: {given:g} {theirs[2]} are {given * theirs[1] / ours[1]:g} {ours[2]}"
    return f"{said}: convert the value from {theirs[2]}"
