"""The mesh of the gateway's tests: one for each module, or one of its own for a test that stops services."""

from __future__ import annotations

from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from support.gateway_mesh import Mesh, running_mesh


@pytest.fixture(scope="module")
def anyio_backend() -> str:
    """Return asyncio, the loop that the services run in."""
    return "asyncio"


@pytest.fixture(scope="module")
async def mesh(anyio_backend: str, tmp_path_factory: pytest.TempPathFactory) -> AsyncIterator[Mesh]:
    """Yield a mesh that all tests of a module share, each with its own sessions."""
    async with running_mesh(tmp_path_factory.mktemp("mesh")) as shared:
        yield shared


@pytest.fixture
async def own_mesh(anyio_backend: str, tmp_path: Path) -> AsyncIterator[Mesh]:
    """Yield a mesh for one test, which may stop its services."""
    async with running_mesh(tmp_path, patience_s=0.3) as own:
        yield own
