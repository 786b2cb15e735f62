"""The formats of gaze files that can be read. To add a format, add a module and its entry in ``FORMATS``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from shift_schemas.errors import InvalidSettings
from shift_schemas.suggestions import did_you_mean

from shift_sources.files import (
    begaze,
    eyelink,
    gazepoint,
    mapped_table,
    neon,
    pupil,
    pupil_cloud_aois,
    smi,
    titta,
    tobii_glasses,
    tobii_pro_lab,
    tx300,
)
from shift_sources.files.options import Options, ScreenSize
from shift_sources.files.samples import NO_EYES, Eyes, Gaze, Marker, Sample
from shift_sources.files.table import Reader
from shift_sources.files.text_file import TextFile, opened

FORMATS: dict[str, tuple[Reader, ...]] = {
    **tx300.FORMATS, **titta.FORMATS, **tobii_pro_lab.FORMATS, **pupil.FORMATS, **neon.FORMATS, **gazepoint.FORMATS,
    **pupil_cloud_aois.FORMATS, **tobii_glasses.FORMATS, **eyelink.FORMATS, **smi.FORMATS,
    **begaze.FORMATS,
    **mapped_table.FORMATS,
}  # fmt: skip
"""Every format, in the order in which a file's content is compared with them."""
MAPPED = "columns"
"""The format of tables whose columns the command line names."""
ABOUT = {
    "tx300": "Tobii TX300: Time, LGazePos2dx, LGazePos2dy, LValidity, RGazePos2dx, RGazePos2dy, RValidity (TSV)",
    "titta": "Titta: device_time_stamp, left_gaze_point_on_display_area_x, ..._y, left_gaze_point_valid, ... (TSV)",
    "tobii": "Tobii Pro Lab and Studio: Recording timestamp, Gaze point X, Y, AOI hit [...] (TSV; --screen for pixels)",
    "pupil": "Pupil Core gaze_positions.csv: gaze_timestamp, norm_pos_x, norm_pos_y, confidence",
    "pupil-surface": "Pupil Core gaze_positions_on_surface_NAME.csv: gaze_timestamp, x_norm, y_norm, on_surf",
    "neon": "Pupil Labs Neon and Invisible gaze.csv: timestamp [ns], gaze x [px], gaze y [px] (--screen)",
    "neon-surface": "Pupil Labs marker mapper: timestamp [ns], gaze position on surface x [normalized], ...",
    "gazepoint": "Gazepoint all_gaze.csv: TIME(...), BPOGX, BPOGY, BPOGV or FPOGX, FPOGY, FPOGV, AOI",
    "pupil-cloud-aois": "Pupil Cloud aoi_fixations.csv, with fixations.csv beside it: aoi label, fixation id",
    "glasses3": 'Tobii Pro Glasses 3 gazedata.gz: {"type":"gaze","timestamp":...,"data":{"gaze2d":...}}, one a line',
    "glasses2": 'Tobii Pro Glasses 2 livedata.json.gz: {"ts":...,"s":0,"gp":[...]}, one a line',
    "eyelink": "EyeLink ASC: SAMPLES GAZE, lines of time, x, y, pupil of each eye; MSG become markers",
    "smi": "SMI IDF converter and BeGaze text: Time, Type, L POR X [px], L POR Y [px], R ...; MSG become markers",
    "begaze": "SMI BeGaze raw data: RecordingTime [ms], Point of Regard Left X [px], ..., AOI Name ... (--screen)",
    "columns": "Any other table, such as GazeBase's; --columns says what its columns are",
}
"""What each format is, with the columns by which it is recognised."""


LONGEST_S = 1e9
"""Seconds, 30 years: more is a wrong unit or a damaged number."""
LARGEST_EYE = 1_000_000
"""The largest pupil size and openness that a chunk can have."""


class GazeFile(NamedTuple):
    """A gaze file that was read whole."""

    samples: list[Sample]
    markers: list[Marker]
    named: bool
    """Whether the samples are AOI names and not points."""


def read_samples(path: Path, screen: ScreenSize | None = None, format_: str = "") -> Iterator[Sample]:
    """Yield the samples of a gaze file in order, without its messages.

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
    options = Options(screen=screen)
    formats = _accepted(format_, options)
    with opened(path) as file:
        for item in _within_limits(file, _recognised(file, formats, options)):
            if isinstance(item, Sample):
                yield item


def read_gaze(path: Path, options: Options | None = None, format_: str = "") -> GazeFile:
    """Return all of a gaze file: samples, messages, and whether it names AOIs. Raise as :func:`read_samples` does."""
    options = options or Options()
    formats = _accepted(format_, options)
    samples: list[Sample] = []
    markers: list[Marker] = []
    with opened(path) as file:
        gaze = _recognised(file, formats, options)
        for item in _within_limits(file, gaze):
            if isinstance(item, Sample):
                samples.append(item)
            else:
                markers.append(item)
    return GazeFile(samples, markers, gaze.named)


def _within_limits(file: TextFile, gaze: Gaze) -> Iterator[Sample | Marker]:
    """Yield the items. Raise :class:`MalformedMessage` for a number that the mesh does not accept."""
    for item in gaze.items:
        if not -LONGEST_S < item.t < LONGEST_S:
            raise file.wrong(file.line, "time", f"{item.t:g} s after the first sample", "a time of the same recording")
        if isinstance(item, Sample) and item.eyes is not NO_EYES:
            for name, value in zip(Eyes._fields, item.eyes, strict=True):
                if value is not None and not 0 <= value <= LARGEST_EYE:
                    raise file.wrong(file.line, name, f"{value:g}", f"0 to {LARGEST_EYE}, or nothing where it was lost")
        yield item


def _accepted(format_: str, options: Options) -> Mapping[str, tuple[Reader, ...]]:
    if format_ and format_ not in FORMATS:
        known = ", ".join(FORMATS)
        raise InvalidSettings(
            f"there is no format {format_!r}; there are {known}{did_you_mean(format_, tuple(FORMATS))}"
        )
    if options.columns and format_ not in ("", MAPPED):
        raise InvalidSettings(f"--columns is for tables of no known format: leave --format {format_} or --columns out")
    if options.columns or format_:
        name = format_ or MAPPED
        return {name: FORMATS[name]}
    return {name: readers for name, readers in FORMATS.items() if name != MAPPED}


def _recognised(file: TextFile, formats: Mapping[str, tuple[Reader, ...]], options: Options) -> Gaze:
    """Return the gaze of the first format that fits. Raise :class:`MalformedMessage` if none does."""
    for readers in formats.values():
        for reader in readers:
            if (gaze := reader(file, options)) is not None:
                return gaze
    rule = f"the header of one of these tables: {', '.join(formats)}; shift-mesh gaze formats lists their columns; "
    rule += "any other table is read with --columns"
    raise file.wrong(1, "header", (file.head or [""])[0].strip(), rule)
