"""Hypothesis without a clock, and which tests run beside which.

``make test`` uses two processes. One runs all tests that start a mesh, a bridge or a browser, one after the other; the
other one runs the container tests, and all tests that stay in their own process.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import settings

settings.register_profile("shift", deadline=None, derandomize=True)  # a busy machine must not fail a property
settings.load_profile("shift")

TESTS = Path(__file__).parent
WITH_PROCESSES = ("e2e", "faults", "ros2", "gateway/web", "docs", "cli")
"""Folders whose tests start processes that compete for the processor."""


def group_of(path: Path) -> str:
    """Return the group of a test file; the tests of one group run one after the other."""
    folder = path.parent.relative_to(TESTS).as_posix()
    if any(folder == name or folder.startswith(f"{name}/") for name in WITH_PROCESSES):
        return "processes"
    return str(path.relative_to(TESTS))


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put each test into its group, before pytest-xdist looks for the groups."""
    for item in items:
        item.add_marker(pytest.mark.xdist_group(group_of(item.path)))
