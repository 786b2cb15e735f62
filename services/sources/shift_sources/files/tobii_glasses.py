"""Recordings of Tobii Pro Glasses 3 (``gazedata.gz``) and Glasses 2 (``livedata.json.gz``): one JSON object a line.

Both have gaze as 0..1 of the scene camera's picture, from the upper left corner, and pupil sizes in mm. Glasses 3 write
all of a sample in one object, with seconds; its ``data`` is empty where gaze is lost. Glasses 2 write each value as an
object of its own, with microseconds; a status ``s`` other than 0 is an error, and objects of one sample have one
``gidx``. Objects of other kinds are skipped.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from typing import Any

from shift_sources.files.options import Options
from shift_sources.files.samples import NO_EYES, Eyes, Gaze, Sample, lost_sample, since_first
from shift_sources.files.table import Reader, refuse_names
from shift_sources.files.text_file import TextFile

MICROSECONDS = 1e6
LARGEST = 1e20
"""Larger than any time in microseconds."""
SIDES = ("left", "right")
Event = tuple[float, Sample | str]


class _Record:
    """One line's JSON object, with its place in the file for error messages."""

    def __init__(self, file: TextFile, line: int, text: str) -> None:
        self.file, self.line = file, line
        try:
            self.fields = json.loads(text)
        except (ValueError, RecursionError):
            raise file.wrong(line, "line", text.strip(), "a JSON object") from None
        if not isinstance(self.fields, dict):
            raise file.wrong(line, "line", text.strip(), "a JSON object")

    def number(self, name: str, value: Any) -> float:
        """Return a number of the object. Raise :class:`MalformedMessage`."""
        if isinstance(value, bool) or not isinstance(value, int | float) or not -LARGEST < value < LARGEST:
            raise self.file.wrong(self.line, name, json.dumps(value), "a number")
        return value

    def point(self, name: str, value: Any) -> tuple[float, float]:
        """Return a pair of numbers of the object. Raise :class:`MalformedMessage`."""
        if not isinstance(value, list) or len(value) != 2:
            raise self.file.wrong(self.line, name, json.dumps(value), "x and y, such as [0.5, 0.5]")
        return self.number(name, value[0]), self.number(name, value[1])

    def size(self, name: str, value: Any) -> float | None:
        """Return a pupil's size; None where it is lost."""
        return None if value is None or self.number(name, value) <= 0 else value


def _records(file: TextFile) -> Iterator[_Record]:
    return (_Record(file, number, line) for number, line in file.lines() if line.strip())


def _glasses_3(file: TextFile) -> Iterator[Event]:
    before = -math.inf
    for record in _records(file):
        if record.fields.get("type") != "gaze":
            continue
        time = record.number("timestamp", record.fields.get("timestamp"))
        if time <= before:
            raise file.wrong(record.line, "timestamp", str(time), "seconds, rising from line to line")
        before = time
        data = record.fields.get("data")
        if not isinstance(data, dict):
            raise file.wrong(record.line, "data", json.dumps(data), "an object, empty where gaze is lost")
        eyes = Eyes(*(_pupil(record, data.get(f"eye{side}")) for side in SIDES))
        if data.get("gaze2d") is None:
            yield time, lost_sample(0.0, eyes)
        else:
            yield time, Sample(0.0, *record.point("gaze2d", data["gaze2d"]), True, eyes)


def _pupil(record: _Record, eye: Any) -> float | None:
    return record.size("pupildiameter", eye.get("pupildiameter")) if isinstance(eye, dict) else None


def _glasses_2(file: TextFile) -> Iterator[Event]:
    before = -math.inf
    eyes, sample_of_eyes = NO_EYES, None
    for record in _records(file):
        fields = record.fields
        if "pd" in fields and fields.get("eye") in SIDES:
            if fields.get("gidx") != sample_of_eyes:
                eyes, sample_of_eyes = NO_EYES, fields.get("gidx")
            size = record.size("pd", fields["pd"]) if _is_fine(record) else None
            eyes = eyes._replace(**{f"pupil_{fields['eye']}": size})
        if "gp" not in fields:
            continue
        time = record.number("ts", fields.get("ts"))
        if time <= before:
            continue
        before = time
        own = eyes if fields.get("gidx") == sample_of_eyes else NO_EYES
        point = record.point("gp", fields["gp"])
        yield time, Sample(0.0, *point, True, own) if _is_fine(record) else lost_sample(0.0, own)


def _is_fine(record: _Record) -> bool:
    return record.number("s", record.fields.get("s")) == 0


def _first(file: TextFile, *keys: str) -> bool:
    """Return whether an object among the first lines has these keys."""
    for line in file.head:
        if not line.startswith("{"):
            return False
        try:
            fields = json.loads(line)
        except (ValueError, RecursionError):
            continue
        if isinstance(fields, dict) and all(key in fields for key in keys):
            return True
    return False


def _read_3(file: TextFile, options: Options) -> Gaze | None:
    if not _first(file, "type", "timestamp", "data"):
        return None
    refuse_names(file.name, "Tobii Glasses 3", options)
    return Gaze(since_first(_glasses_3(file), 1.0))


def _read_2(file: TextFile, options: Options) -> Gaze | None:
    if not _first(file, "ts", "s"):
        return None
    refuse_names(file.name, "Tobii Glasses 2", options)
    return Gaze(since_first(_glasses_2(file), MICROSECONDS))


FORMATS: dict[str, tuple[Reader, ...]] = {"glasses3": (_read_3,), "glasses2": (_read_2,)}
