"""A whole mesh and a browser for the tests of the web page."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from functools import partial

import pytest
from playwright.sync_api import Browser
from shift_runtime.rest_client import RestClient
from support.browser import Tab, chromium, opened_tab
from support.whole_mesh import LiveMesh, running_mesh

OpenTab = Callable[..., AbstractContextManager[Tab]]


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """The browser of a module: while it is open, its event loop runs, and no anyio test can start one."""
    with chromium() as found:
        yield found


@pytest.fixture(scope="module")
def mesh(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LiveMesh]:
    """A mesh of the module's own."""
    with running_mesh(tmp_path_factory.mktemp("mesh")) as found:
        yield found


@pytest.fixture
def open_tab(browser: Browser, mesh: LiveMesh) -> OpenTab:
    """Open a tab of the mesh's page."""
    return partial(opened_tab, browser, mesh.url)


@pytest.fixture
def tab(open_tab: OpenTab) -> Iterator[Tab]:
    """One open tab."""
    with open_tab() as found:
        yield found


@pytest.fixture
def shift(mesh: LiveMesh) -> Iterator[RestClient]:
    """A REST client of the mesh."""
    with RestClient(mesh.url) as found:
        yield found
