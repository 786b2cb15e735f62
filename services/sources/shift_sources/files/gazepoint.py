"""Tables of Gazepoint Analysis (``..._all_gaze.csv``): seconds, 0..1 from the upper left corner, 1 where it is valid.

The time column is called ``TIME``, with the time of the recording's start in parentheses. The best point of gaze is
used (``BPOGX``, ``BPOGY``, ``BPOGV``) if the table has it, and the point of the fixation (``FPOG...``) otherwise. The
column ``AOI`` names the AOI that gaze is on, and is empty elsewhere. Pupil sizes are in mm (``LPMM``, valid where
``LPMMV`` is 1) or else in the camera's pixels (``LPD``, valid where ``LPV`` is 1).
"""

from __future__ import annotations

from functools import partial

from shift_sources.files.aoi_names import study_name
from shift_sources.files.options import Options
from shift_sources.files.samples import Eyes, Sample, lost_sample, named_sample
from shift_sources.files.table import Row, TableFormat, table_reader

POINTS = ("BPOG", "FPOG")
AOI = "AOI"
PUPILS = ((("LPMM", "LPMMV"), ("LPD", "LPV")), (("RPMM", "RPMMV"), ("RPD", "RPV")))
"""For each eye, the columns of size and validity, the better ones first."""


def _point(t: float, row: Row, point: str) -> Sample:
    eyes = _eyes(row)
    x, y = row.number(f"{point}X"), row.number(f"{point}Y")
    if not _is_valid(row, point) or x is None or y is None:
        return lost_sample(t, eyes)
    return Sample(t, x, y, True, eyes)


def _name(t: float, row: Row, point: str, options: Options) -> Sample:
    tracked = not point or _is_valid(row, point)
    name = study_name(row.text(AOI), options, lambda rule: row.wrong(AOI, rule))
    return named_sample(t, name, tracked, _eyes(row))


def _is_valid(row: Row, point: str) -> bool:
    valid = row.number(f"{point}V")
    if valid is not None and valid not in (0, 1):
        raise row.wrong(f"{point}V", "1 (valid) or 0")
    return valid == 1


def _eyes(row: Row) -> Eyes:
    left, right = (_pupil(row, columns) for columns in PUPILS)
    return Eyes(left, right)


def _pupil(row: Row, columns: tuple[tuple[str, str], ...]) -> float | None:
    for size, validity in columns:
        if size in row.columns:
            lost = validity in row.columns and row.number(validity) != 1
            return None if lost else row.size(size)
    return None


def _recognise(header: list[str], options: Options) -> TableFormat | None:
    times = [name for name in header if name == "TIME" or name.startswith("TIME(")]
    if not times:
        return None
    point = next((p for p in POINTS if {f"{p}X", f"{p}Y", f"{p}V"} <= set(header)), "")
    named = AOI in header and (options.named or not point)
    if not point and not named:
        return None
    columns = (f"{point}X", f"{point}Y", f"{point}V") if point else (AOI,)
    sample = partial(_name, point=point, options=options) if named else partial(_point, point=point)
    return TableFormat("Gazepoint", times[0], (times[0], *columns), sample, ticks=1, separator=",", named=named)


FORMATS = {"gazepoint": (table_reader(_recognise),)}
