"""Live sources run on asyncio."""

from __future__ import annotations

import pytest


@pytest.fixture
def anyio_backend() -> str:
    """Return asyncio, the loop that a source runs in."""
    return "asyncio"
