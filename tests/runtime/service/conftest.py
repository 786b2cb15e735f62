"""A running worker."""

from __future__ import annotations

from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from support.runtime_fixtures import until
from support.worker_rig import Rig, config, session


@pytest.fixture
async def live(tmp_path: Path) -> AsyncIterator[Rig]:
    """A worker that has read the start of session s1."""
    rig = Rig(tmp_path / "decider.sqlite")
    rig.recorder.publish(session(), config())
    rig.start()
    await rig.ready()
    await until(lambda: rig.config() == 1)
    yield rig
    if not rig.running.done():
        await rig.stop()
