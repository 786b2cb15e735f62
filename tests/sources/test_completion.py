"""Completion of a queue."""

from __future__ import annotations

import asyncio

import pytest
from shift_sources.completion import Completion

pytestmark = pytest.mark.anyio


@pytest.fixture
def anyio_backend() -> str:
    return "asyncio"


async def test_wait_returns_when_earlier_items_are_finished() -> None:
    completion = Completion()
    completion.receive()
    waiting = asyncio.create_task(completion.wait(10.0))
    await asyncio.sleep(0)
    completion.receive()
    assert not completion.idle
    completion.finish()
    assert await waiting is True
    assert not completion.idle, "the second item is not finished"
    completion.finish()
    assert completion.idle


async def test_wait_ends_after_its_timeout() -> None:
    completion = Completion()
    completion.receive()
    assert await completion.wait(0.01) is False
    completion.finish()
    assert await completion.wait(0.0) is True
