"""Columns of AOI hits in tables of Tobii: ``AOI hit [Stimulus - AOI]`` of Pro Lab and ``AOI[AOI]Hit`` of Studio.

A cell is 1 while gaze is on the AOI, 0 while it is not, and empty (Studio: also -1) while the AOI is not shown. Where
gaze is on several AOIs, the first column counts. In Pro Lab, the AOI's name is what follows the last ``" - "``.
"""

from __future__ import annotations

import re

from shift_sources.files.aoi_names import study_name
from shift_sources.files.options import Options
from shift_sources.files.table import Row

HIT = re.compile(r"AOI hit \[(?P<pro_lab>.+)\]|AOI\[(?P<studio>.+)\] ?Hit")
ON, OFF = frozenset({"1"}), frozenset({"0", "", "-1"})


def hit_columns(header: list[str]) -> tuple[str, ...]:
    """Return the columns of AOI hits, in order."""
    return tuple(name for name in header if HIT.fullmatch(name))


def aoi_hit(row: Row, columns: tuple[str, ...], options: Options) -> str | None:
    """Return the study's name of the first AOI that gaze is on; None if it is on no AOI of the study."""
    for column in columns:
        cell = row.text(column)
        if cell not in ON | OFF:
            raise row.wrong(column, "1 (gaze is on the AOI), 0, or nothing while the AOI is not shown")
        if cell in ON and (name := _name(row, column, options)) is not None:
            return name
    return None


def _name(row: Row, column: str, options: Options) -> str | None:
    match = HIT.fullmatch(column)
    assert match is not None
    whole = match["pro_lab"] or match["studio"]
    short = whole.rpartition(" - ")[2] if match["pro_lab"] else whole
    return study_name(short, options, lambda rule: row.wrong_place(column, short, rule), also=(whole,))
