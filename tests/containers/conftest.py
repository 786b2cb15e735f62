"""The mesh in containers, once for all tests of this folder; the logs of a failing test are shown with it."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from support.container_stack import Stack, why_no_engine


@pytest.fixture(scope="module")
def stack() -> Iterator[Stack]:
    """Build and start the whole mesh under its own project name and port."""
    reason = why_no_engine()
    if reason:
        pytest.skip(reason)
    stack = Stack.built()
    try:
        stack.up()
        yield stack
    finally:
        stack.remove()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Iterator[None]:
    report = yield
    stack = getattr(item, "funcargs", {}).get("stack")
    if report.when == "call" and report.failed and stack is not None:
        report.sections.append(("containers", stack.logs()))
    return report
