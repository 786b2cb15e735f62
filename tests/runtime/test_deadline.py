"""Deadlines: how much time is left, and waiting for an event until then."""

import asyncio

import pytest
from shift_runtime.deadline import Deadline

pytestmark = pytest.mark.anyio


async def test_time_left_ends_at_zero() -> None:
    assert 59.0 < Deadline(60.0).left_s <= 60.0
    assert Deadline(-1.0).left_s == 0.0


async def test_event_within_the_deadline_is_seen() -> None:
    event = asyncio.Event()
    asyncio.get_running_loop().call_later(0.01, event.set)
    assert await Deadline(30.0).is_set(event)


async def test_wait_without_an_event_ends_at_the_deadline() -> None:
    deadline = Deadline(0.01)
    assert not await deadline.is_set(asyncio.Event())
    assert deadline.left_s == 0.0


async def test_outer_timeout_is_not_taken_for_the_deadline() -> None:
    with pytest.raises(TimeoutError):
        async with asyncio.timeout(0.01):
            await Deadline(30.0).is_set(asyncio.Event())
