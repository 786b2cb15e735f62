"""One mesh per module for the tests that leave it whole, one of its own for those that do not."""

from __future__ import annotations

from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from support.gateway_mesh import Mesh, running_mesh


@pytest.fixture(scope="module")
def anyio_backend() -> str:
    """Asyncio, the loop that the services run in."""
    return "asyncio"


@pytest.fixture(scope="module")
async def mesh(anyio_backend: str, tmp_path_factory: pytest.TempPathFactory) -> AsyncIterator[Mesh]:
    """A mesh that every test of a module shares, each with sessions of its own."""
    async with running_mesh(tmp_path_factory.mktemp("mesh")) as shared:
        yield shared


@pytest.fixture
async def own_mesh(anyio_backend: str, tmp_path: Path) -> AsyncIterator[Mesh]:
    """A mesh to stop services of."""
    async with running_mesh(tmp_path, patience_s=0.3) as own:
        yield own
