"""A mesh that several tests of a module share."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from support.whole_mesh import LiveMesh, running_mesh


@pytest.fixture(scope="module")
def mesh(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LiveMesh]:
    with running_mesh(tmp_path_factory.mktemp("mesh")) as running:
        yield running
