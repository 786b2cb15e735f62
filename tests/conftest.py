"""Hypothesis without a clock, and which tests run beside which.

``make test`` uses two processes. One runs all tests that start a mesh, a bridge or a browser, one after the other; the
other one runs the container tests, and all tests that stay in their own process.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import settings
from xdist.remote import Producer
from xdist.scheduler import LoadScopeScheduling

settings.register_profile("shift", deadline=None, derandomize=True)  # a busy machine must not fail a property
settings.load_profile("shift")

WITH_PROCESSES = ("e2e", "faults", "ros2", "gateway/web", "docs", "cli")
"""Folders whose tests start processes that compete for the processor."""


def group_of(nodeid: str) -> str:
    """Return the group of a test: its file, or one group for all tests that start processes."""
    file = Path(nodeid.partition("::")[0])
    folder = file.relative_to("tests").parent.as_posix()
    if any(folder == name or folder.startswith(f"{name}/") for name in WITH_PROCESSES):
        return "processes"
    return file.as_posix()


class GroupScheduling(LoadScopeScheduling):
    """Gives each group of tests to one worker, the largest group first."""

    def _split_scope(self, nodeid: str) -> str:
        return group_of(str(nodeid))


def pytest_xdist_make_scheduler(config: pytest.Config, log: Producer) -> GroupScheduling:
    """Return the scheduler of pytest-xdist. (Its marker ``xdist_group`` has no effect with pytest 9.2.)"""
    return GroupScheduling(config, log)
