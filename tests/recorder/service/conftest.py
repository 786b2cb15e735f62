"""A running recorder."""

from __future__ import annotations

from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from support.recorder_rig import RecorderRig


@pytest.fixture
def anyio_backend() -> str:
    """The services run on asyncio."""
    return "asyncio"


@pytest.fixture
async def rig(tmp_path: Path) -> AsyncIterator[RecorderRig]:
    """A recorder with session s1; the other services have read nothing of it yet."""
    rig = RecorderRig(tmp_path)
    rig.start()
    await rig.begin()
    yield rig
    if not rig.running.done():
        await rig.crash()
