"""Tables of Gazepoint Analysis (``..._all_gaze.csv``): seconds, 0..1 from the upper left corner, 1 where it is valid.

The time column is called ``TIME``, with the time of the recording's start in parentheses. The best point of gaze is
used (``BPOGX``, ``BPOGY``, ``BPOGV``) if the table has it, and the point of the fixation (``FPOG...``) otherwise.
"""

from __future__ import annotations

from functools import partial

from shift_sources.files.samples import Sample
from shift_sources.files.table import Recogniser, Row, ScreenSize, TableFormat

POINTS = ("BPOG", "FPOG")


def _sample(t: float, row: Row, point: str) -> Sample:
    valid = row.number(f"{point}V")
    if valid is not None and valid not in (0, 1):
        raise row.wrong(f"{point}V", "1 (valid) or 0")
    x, y = row.number(f"{point}X"), row.number(f"{point}Y")
    if not valid or x is None or y is None:
        return Sample(t, None, None, False)
    return Sample(t, x, y, True)


def _recognise(header: list[str], screen: ScreenSize | None) -> TableFormat | None:
    times = [name for name in header if name == "TIME" or name.startswith("TIME(")]
    for point in POINTS:
        columns = (f"{point}X", f"{point}Y", f"{point}V")
        if times and set(columns) <= set(header):
            sample = partial(_sample, point=point)
            return TableFormat("Gazepoint", times[0], (times[0], *columns), sample, ticks=1, separator=",")
    return None


_gazepoint: Recogniser = _recognise
FORMATS = {"gazepoint": (_gazepoint,)}
