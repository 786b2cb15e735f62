"""The data dictionary: every column of every table, with its type, unit, meaning and source. Pure."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping

from shift_recording.export.columns import Column

HEADINGS = ("table", "column", "type", "unit", "meaning", "topic")


def dictionary_csv(tables: Mapping[str, tuple[Column, ...]]) -> str:
    """Return the data dictionary as CSV."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(HEADINGS)
    for table, columns in tables.items():
        writer.writerows((table, c.name, c.type, c.unit, c.meaning, c.source) for c in columns)
    return text.getvalue()
