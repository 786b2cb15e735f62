"""Decisions as contextual-bandit lines of Vowpal Wabbit. Pure.

One line is ``ACTION:COST:PROBABILITY TAG|context FEATURES``: the action's number from 1, the negated reward, and the
propensity. Decisions without a report, and overrides, which have no propensity, have no line.
"""

from __future__ import annotations

import re

from shift_recording.export.tables import Row

_NAME = re.compile(r"[\s:|]+")


def line_of(row: Row) -> str | None:
    """Return the line of a row of the table ``decisions``, or None if it has no reward or no propensity."""
    if row.get("reward") is None or row.get("propensity") is None or row.get("action") is None:
        return None
    features = [
        *(f"{name}={_name(row[f'observation_{name}'])}" for name in ("capacity", "gaze", "awareness")),
        f"state={_name(row['state'])}", f"task={_name(row['task'])}",
    ]  # fmt: skip
    if (capacity := row.get("capacity_value")) is not None:
        features.append(f"capacity_value:{capacity!r}")
    tag = _name(f"{row['session']}/{row['decision_id']}")
    return f"{row['action']}:{-row['reward']!r}:{row['propensity']!r} {tag}|context {' '.join(features)}"


def _name(text: object) -> str:
    """Return a text without the characters that separate in a line."""
    return _NAME.sub("_", str(text))
