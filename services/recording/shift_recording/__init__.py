"""Recordings as a library: segments, merging, reading, replay and export.

>>> import shift_recording
>>> shift_recording.frames("s1.mcap").decisions  # doctest: +SKIP
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from shift_recording.export.frames import Frames


def frames(*recordings: str | Path, covariates: str | Path | None = None) -> Frames:
    """Return the tables of recordings as pandas frames; see :func:`shift_recording.export.frames.frames`."""
    from shift_recording.export.frames import frames as read_frames

    return read_frames(*recordings, covariates=covariates)
