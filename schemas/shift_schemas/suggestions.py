"""Suggestions for mistyped names: the nearest known name, and a level made of any text. Pure.

Every refusal of a name lists the known names and ends with :func:`did_you_mean`.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable

from shift_schemas.ids import propose_id


def nearest(given: object, known: Iterable[str]) -> str | None:
    """Return the name that ``given`` resembles most, whatever its case; ``None`` if it resembles none."""
    by_case: dict[str, str] = {}
    for name in known:
        by_case.setdefault(name.casefold(), name)
    found = difflib.get_close_matches(str(given)[:200].casefold(), list(by_case), n=1)
    return by_case[found[0]] if found else None


def did_you_mean(given: object, known: Iterable[str]) -> str:
    """Return ``"; did you mean 'grasp'?"``, or an empty string if no known name resembles ``given``."""
    near = nearest(given, known)
    return f"; did you mean {near!r}?" if near is not None else ""


def level_like(text: str) -> str:
    """Return a strategy's level that resembles ``text``: lower case, words joined with ``_``; else empty."""
    return propose_id(text).lower().replace("-", "_").lstrip("0123456789_")[:32]
