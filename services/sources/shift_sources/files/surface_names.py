"""The name of the surface that a table of Pupil Labs belongs to, as an AOI. Pure.

Pupil Player writes one table a surface, and the surface's name is in the file's:
``gaze_positions_on_surface_NAME.csv``. A table of Pupil Cloud is called ``gaze.csv``, and does not name its surface.
"""

from __future__ import annotations

import re

from shift_sources.files.aoi_names import study_name
from shift_sources.files.options import Options
from shift_sources.files.table import Row

NAMED = re.compile(r"gaze.*on_surface_(?P<surface>.+?)\.csv(\.gz)?", re.IGNORECASE)


def surface_name(row: Row, options: Options) -> str | None:
    """Return the study's name of the surface of a row's table.

    Raise :class:`MalformedMessage` if the file's name does not tell it and ``--aoi-map`` does not say it either.
    """
    stem = row.file.split(".")[0]
    match = NAMED.fullmatch(row.file)
    if match is None and stem not in options.aoi_map:
        rule = (
            "gaze_positions_on_surface_NAME.csv, since the surface's name is the AOI's; or name the surface with "
            f"--aoi-map '{stem}=NAME'"
        )
        raise row.wrong_place("name of the file", row.file, rule)
    surface = stem if match is None else match["surface"]
    return study_name(surface, options, lambda rule: row.wrong_place("name of the file", surface, rule))
