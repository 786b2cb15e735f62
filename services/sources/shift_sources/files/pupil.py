"""Tables of Pupil Core (Pupil Player's export): seconds, 0..1 with the origin at the lower left, a confidence 0..1.

``gaze_positions.csv`` is gaze in the scene camera's picture; ``gaze_positions_on_surface_NAME.csv`` is gaze on a
surface, which the study's stimulus can be. Where both eyes are tracked one by one, a time can repeat.
"""

from __future__ import annotations

from functools import partial

from shift_sources.files.samples import Sample
from shift_sources.files.table import Row, TableFormat, is_table

LEAST_CONFIDENCE = 0.6
"""Pupil Labs' documentation recommends to leave out gaze below this confidence."""
YES = frozenset({"true", "1"})


def _sample(t: float, row: Row, x_column: str, y_column: str, on_surface: str = "") -> Sample:
    x, y, confidence = row.number(x_column), row.number(y_column), row.number("confidence")
    if confidence is not None and not 0 <= confidence <= 1:
        raise row.wrong("confidence", "0..1")
    sure = confidence is not None and confidence >= LEAST_CONFIDENCE
    if x is None or y is None or not sure or (on_surface and row.text(on_surface).lower() not in YES):
        return Sample(t, None, None, False)
    return Sample(t, x, 1 - y, True)


def _table(name: str, time_column: str, x_column: str, y_column: str, on_surface: str = "") -> TableFormat:
    columns = (time_column, x_column, y_column, "confidence", *([on_surface] if on_surface else []))
    sample = partial(_sample, x_column=x_column, y_column=y_column, on_surface=on_surface)
    return TableFormat(name, time_column, columns, sample, ticks=1, separator=",", repeats=True)


FORMATS = {
    "pupil": (is_table(_table("Pupil Core", "gaze_timestamp", "norm_pos_x", "norm_pos_y")),),
    "pupil-surface": (
        is_table(_table("Pupil Core surface", "gaze_timestamp", "x_norm", "y_norm", "on_surf")),
        is_table(_table("Pupil Core surface", "world_timestamp", "x_norm", "y_norm", "on_surf")),
    ),
}
