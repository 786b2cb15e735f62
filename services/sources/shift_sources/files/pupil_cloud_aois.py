"""Fixations on AOIs of Pupil Cloud: ``aoi_fixations.csv``, with ``fixations.csv`` of the same folder.

``aoi_fixations.csv`` names the AOI of a fixation (``aoi label``, in older exports ``aoi name``), and ``fixations.csv``
has its start and end in nanoseconds (Pupil Labs' documentation). Gaze is on the AOI from the fixation's start to its
end, and on no AOI between fixations. A fixation on several AOIs counts for the one that the file lists first. A file
with several recordings needs ``--recording``. Names of recordings and wearers are not read.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from shift_schemas.errors import InvalidSettings

from shift_sources.files.aoi_names import study_name
from shift_sources.files.options import Options
from shift_sources.files.recordings import OneRecording
from shift_sources.files.samples import Gaze, Sample, named_sample, since_first
from shift_sources.files.table import Header, Row, cells_of
from shift_sources.files.text_file import TextFile, opened

NANOSECONDS = 1e9
STEP_NS = 100_000_000
"""How often a fixation's AOI is repeated. Chosen: well below the 1 s for which a study lets an AOI name stand."""
LABELS = ("aoi label", "aoi name")
FIXATION, RECORDING, SECTION = "fixation id", "recording id", "section id"
START, END = "start timestamp [ns]", "end timestamp [ns]"
Key = tuple[str, ...]


class _Table(NamedTuple):
    """Rows of a table, with the columns that tell fixations apart."""

    rows: Iterator[Row]
    columns: set[str]


def _table(file: TextFile, needed: set[str]) -> _Table:
    header = Header(cells_of(file.head[0], ",") if file.head else [])
    if missing := needed - set(header.columns):
        rule = f"a header with the column {sorted(missing)[0]}"
        raise file.wrong(1, "header", (file.head or [""])[0].strip(), rule)
    lines = ((number, line) for number, line in file.lines() if number > 1 and line.strip())
    return _Table((Row(file.name, n, header, cells_of(line, ",")) for n, line in lines), set(header.columns))


def _key(row: Row, parts: list[str]) -> Key:
    return tuple(row.text(part) for part in parts)


def _names(file: TextFile, parts: list[str], label: str, options: Options) -> dict[Key, str | None]:
    """Return the study's name of the first AOI of each fixation."""
    names: dict[Key, str | None] = {}
    for row in _table(file, {FIXATION, label}).rows:
        ours = RECORDING not in row.columns or row.text(RECORDING).startswith(options.recording)
        if ours and row.text(FIXATION):
            key = _key(row, parts)
            names[key] = names.get(key) or _name(row, label, options)
    return names


def _name(row: Row, label: str, options: Options) -> str | None:
    return study_name(row.text(label), options, lambda rule: row.wrong(label, rule))


def _fixations(table: _Table, options: Options) -> Iterator[tuple[int, int, Row]]:
    """Yield start and end of each fixation of one recording, in nanoseconds."""
    is_taken = OneRecording([RECORDING], options.recording)
    before = -1
    for row in table.rows:
        if not is_taken(row):
            continue
        start, end = row.ticks(START), row.ticks(END)
        if start is None or start < before:
            raise row.wrong(START, "nanoseconds, at or after the end of the fixation before")
        if end is None or end < start:
            raise row.wrong(END, "nanoseconds, at or after the fixation's start")
        before = int(end)
        yield int(start), before, row


def _events(file: TextFile, label: str, options: Options) -> Iterator[tuple[float, Sample | str]]:
    path = file.path.with_name("fixations.csv")
    if not path.exists():
        raise InvalidSettings(f"{file.name} needs fixations.csv of the same folder, which has the fixations' times")
    with opened(path) as other:
        table = _table(other, {FIXATION, START, END})
        first = set(cells_of(file.head[0], ","))
        parts = [FIXATION, *(part for part in (SECTION, RECORDING) if part in first & table.columns)]
        names = _names(file, parts, label, options)
        last: int | None = None
        for start, end, row in _fixations(table, options):
            if last is not None and last < start:
                yield last, named_sample(0.0, None)
            name = names.get(_key(row, parts))
            for time in range(start, end, STEP_NS):
                yield time, named_sample(0.0, name)
            last = end
        if last is not None:
            yield last, named_sample(0.0, None)


def _read(file: TextFile, options: Options) -> Gaze | None:
    header = set(cells_of(file.head[0], ",")) if file.head else set()
    label = next((name for name in LABELS if name in header), None)
    if label is None or FIXATION not in header:
        return None
    return Gaze(since_first(_events(file, label, options), NANOSECONDS), named=True)


FORMATS = {"pupil-cloud-aois": (_read,)}
