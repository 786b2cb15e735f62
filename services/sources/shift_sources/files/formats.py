"""The formats of gaze files that can be read. To add a format, add a module and its entry in ``FORMATS``."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from shift_sources.files import titta, tx300
from shift_sources.files.samples import Sample
from shift_sources.files.table import TableFormat, read_table

FORMATS: tuple[TableFormat, ...] = (*tx300.FORMATS, *titta.FORMATS)
"""Every format, in the order in which a file's content is compared with them."""


def read_samples(path: Path) -> Iterator[Sample]:
    """Yield the samples of a gaze file in order; the format is recognised by the content.

    Raises
    ------
    InvalidSettings
        The file cannot be opened.
    MalformedMessage
        The file has none of the formats, or a row is wrong. The message names the file, the line, the value and the
        rule; it is raised when that line is reached.
    """
    return read_table(path, FORMATS)
