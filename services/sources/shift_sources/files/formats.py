"""The formats of gaze files that can be read. To add a format, add a module and its entry in ``FORMATS``."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from shift_schemas.errors import InvalidSettings
from shift_schemas.suggestions import did_you_mean

from shift_sources.files import gazepoint, neon, pupil, titta, tobii_pro_lab, tx300
from shift_sources.files.samples import Sample
from shift_sources.files.table import Recogniser, ScreenSize, read_table

FORMATS: dict[str, tuple[Recogniser, ...]] = {
    **tx300.FORMATS, **titta.FORMATS, **tobii_pro_lab.FORMATS, **pupil.FORMATS, **neon.FORMATS, **gazepoint.FORMATS,
}  # fmt: skip
"""Every format, in the order in which a file's content is compared with them."""
ABOUT = {
    "tx300": "Tobii TX300: Time, LGazePos2dx, LGazePos2dy, LValidity, RGazePos2dx, RGazePos2dy, RValidity (TSV)",
    "titta": "Titta: device_time_stamp, left_gaze_point_on_display_area_x, ..._y, left_gaze_point_valid, ... (TSV)",
    "tobii": "Tobii Pro Lab and Studio: Recording timestamp, Gaze point X, Gaze point Y (TSV; --screen for pixels)",
    "pupil": "Pupil Core gaze_positions.csv: gaze_timestamp, norm_pos_x, norm_pos_y, confidence",
    "pupil-surface": "Pupil Core gaze_positions_on_surface_NAME.csv: gaze_timestamp, x_norm, y_norm, on_surf",
    "neon": "Pupil Labs Neon and Invisible gaze.csv: timestamp [ns], gaze x [px], gaze y [px] (--screen)",
    "neon-surface": "Pupil Labs marker mapper: timestamp [ns], gaze position on surface x [normalized], ...",
    "gazepoint": "Gazepoint all_gaze.csv: TIME(...), BPOGX, BPOGY, BPOGV or FPOGX, FPOGY, FPOGV",
}
"""What each format is, with the columns by which it is recognised."""


def read_samples(path: Path, screen: ScreenSize | None = None, format_: str = "") -> Iterator[Sample]:
    """Yield the samples of a gaze file in order.

    Parameters
    ----------
    screen
        The size in pixels, for formats with positions in pixels.
    format_
        The name of the only format that is accepted; empty: the format is recognised by the content.

    Raises
    ------
    InvalidSettings
        The file cannot be opened, there is no such format, or the size is needed and not given.
    MalformedMessage
        The file has none of the formats, or a row is wrong. The message names the file, the line, the value and the
        rule; it is raised when that line is reached.
    """
    if format_ and format_ not in FORMATS:
        known = ", ".join(FORMATS)
        raise InvalidSettings(
            f"there is no format {format_!r}; there are {known}{did_you_mean(format_, tuple(FORMATS))}"
        )
    return read_table(path, {format_: FORMATS[format_]} if format_ else FORMATS, screen)
