"""Background tasks live as long as they run."""

from __future__ import annotations

import asyncio

import pytest
from shift_runtime.service.background import BackgroundTasks

pytestmark = pytest.mark.anyio


async def test_tasks_are_held_until_they_end() -> None:
    tasks, done = BackgroundTasks(), []

    async def work(n: int) -> None:
        await asyncio.sleep(0)
        done.append(n)

    for n in (1, 2):
        tasks.start(work(n))
    assert len(tasks) == 2
    await tasks.wait(5.0)
    assert sorted(done) == [1, 2]
    assert len(tasks) == 0
    await tasks.wait(5.0)


async def test_wait_ends_after_its_time_and_cancel_ends_the_tasks() -> None:
    tasks = BackgroundTasks()
    cancelled = asyncio.Event()

    async def work() -> None:
        try:
            await asyncio.sleep(60.0)
        finally:
            cancelled.set()

    tasks.start(work())
    await tasks.wait(0.01)
    assert len(tasks) == 1
    tasks.cancel()
    await tasks.wait(5.0)
    assert cancelled.is_set()
    assert len(tasks) == 0
