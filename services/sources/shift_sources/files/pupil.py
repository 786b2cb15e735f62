"""Tables of Pupil Core (Pupil Player's export): seconds, 0..1 with the origin at the lower left, a confidence 0..1.

``gaze_positions.csv`` is gaze in the scene camera's picture; ``gaze_positions_on_surface_NAME.csv`` is gaze on a
surface, which the study's stimulus can be, or, with ``--aoi``, an AOI. Where both eyes are tracked one by one, a time
can repeat. Older versions write ``on_srf`` for ``on_surf``. Pupil sizes are in another table, ``pupil_positions.csv``,
which is not read.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from shift_sources.files.options import Options
from shift_sources.files.samples import Sample, lost_sample, named_sample
from shift_sources.files.surface_names import surface_name
from shift_sources.files.table import Reader, Row, TableFormat, is_table, table_reader

LEAST_CONFIDENCE = 0.6
"""Pupil Labs' documentation recommends to leave out gaze below this confidence."""
YES = frozenset({"true", "1"})


def _is_sure(row: Row) -> bool:
    confidence = row.number("confidence")
    if confidence is not None and not 0 <= confidence <= 1:
        raise row.wrong("confidence", "0..1")
    return confidence is not None and confidence >= LEAST_CONFIDENCE


def _point(t: float, row: Row, x_column: str, y_column: str, on_surface: str = "") -> Sample:
    x, y, sure = row.number(x_column), row.number(y_column), _is_sure(row)
    if x is None or y is None or not sure or (on_surface and row.text(on_surface).lower() not in YES):
        return lost_sample(t)
    return Sample(t, x, 1 - y, True)


def _name(t: float, row: Row, on_surface: str, options: Options) -> Sample:
    on_it = row.text(on_surface).lower() in YES
    return named_sample(t, surface_name(row, options) if on_it else None, _is_sure(row))


def _table(name: str, time_column: str, x_column: str, y_column: str, on_surface: str = "") -> TableFormat:
    columns = (time_column, x_column, y_column, "confidence", *([on_surface] if on_surface else []))
    sample = partial(_point, x_column=x_column, y_column=y_column, on_surface=on_surface)
    return TableFormat(name, time_column, columns, sample, ticks=1, separator=",", repeats=True)


def _surface(time_column: str, on_surface: str) -> Reader:
    points = _table("Pupil Core surface", time_column, "x_norm", "y_norm", on_surface)

    def recognise(header: list[str], options: Options) -> TableFormat | None:
        if not set(points.columns) <= set(header):
            return None
        names = partial(_name, on_surface=on_surface, options=options)
        return replace(points, sample=names, named=True) if options.named else points

    return table_reader(recognise)


FORMATS: dict[str, tuple[Reader, ...]] = {
    "pupil": (is_table(_table("Pupil Core", "gaze_timestamp", "norm_pos_x", "norm_pos_y")),),
    "pupil-surface": tuple(
        _surface(time_column, on_surface)
        for time_column in ("gaze_timestamp", "world_timestamp")
        for on_surface in ("on_surf", "on_srf")
    ),
}
