"""Recordings that many tests read."""

from __future__ import annotations

from pathlib import Path

import pytest
from shift_recording import merging as finishing
from support.recordings import finished, interleaved, write_segment


@pytest.fixture(scope="session")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a finished recording of 120 messages in many chunks."""
    folder = tmp_path_factory.mktemp("whole")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(finishing, "CHUNK_BYTES", 6000)
        return finished(folder, [write_segment(folder / "segments", interleaved(40))]).path


@pytest.fixture(scope="session")
def segment(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return an unfinished segment of 120 messages in six chunks."""
    return write_segment(tmp_path_factory.mktemp("segment"), interleaved(40))
