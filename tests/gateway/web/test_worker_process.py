"""Work in a process of its own: its parts, its errors, and its end when nobody wants them."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Coroutine
from concurrent.futures import ThreadPoolExecutor
from contextlib import aclosing
from typing import Any

import pytest
from shift_gateway.web.worker_process import Progress, WorkFailed, parts_of

HERE = "support.worker_functions"


def collected(function: str, *arguments: str) -> list[object]:
    """All parts of a work."""

    async def collect() -> list[object]:
        return [part async for part in parts_of(f"{HERE}:{function}", *arguments)]

    return run_in_thread(collect())


def run_in_thread(work: Coroutine[Any, Any, Any]) -> Any:
    """Run it in an event loop of its own: playwright has one in the tests' thread."""
    with ThreadPoolExecutor(1) as thread:
        return thread.submit(asyncio.run, work).result()


def test_parts_come_in_their_order_and_prints_do_not_disturb() -> None:
    assert collected("send_words", "a", "b") == ["a", Progress(0.5), "b", Progress(1.0)]


@pytest.mark.parametrize(
    ("function", "words"), [("refuse", "there is no coffee"), ("fail", "KeyError: 'coffee'"), ("die", "exit code -9")]
)
def test_error_of_the_work_is_told(function: str, words: str) -> None:
    with pytest.raises(WorkFailed, match=words):
        collected(function)


def test_process_ends_when_nobody_wants_its_parts() -> None:
    async def first_part() -> int:
        async with aclosing(parts_of(f"{HERE}:send_forever")) as parts:
            async for pid in parts:
                return int(pid)
        raise AssertionError

    pid = run_in_thread(first_part())
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)
