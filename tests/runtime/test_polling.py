"""Polling: a condition is asked until it is true or its time is over."""

from __future__ import annotations

import asyncio

import pytest
from shift_runtime.polling import poll

pytestmark = pytest.mark.anyio


class Countdown:
    """True at the n-th question."""

    def __init__(self, n: int, answer_s: float = 0.0) -> None:
        self.n = n
        self.answer_s = answer_s
        self.asked = 0

    async def __call__(self) -> bool:
        await asyncio.sleep(self.answer_s)
        self.asked += 1
        return self.asked >= self.n


@pytest.mark.parametrize("n", [1, 2, 7])
async def test_poll_asks_until_the_condition_is_true(n: int) -> None:
    condition = Countdown(n)
    assert await poll(condition, timeout_s=30.0, pause_s=0.0)
    assert condition.asked == n


async def test_poll_ends_after_its_time() -> None:
    condition = Countdown(10**9)
    assert not await poll(condition, timeout_s=0.02, pause_s=0.005)
    assert condition.asked >= 2


@pytest.mark.parametrize(("n", "found"), [(1, True), (2, False)])
async def test_condition_is_asked_once_to_its_end_without_any_time(n: int, found: bool) -> None:
    condition = Countdown(n, answer_s=0.01)
    assert await poll(condition, timeout_s=0.0, pause_s=0.0) == found
    assert condition.asked == 1


async def test_an_error_of_the_condition_ends_the_poll() -> None:
    async def fail() -> bool:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        await poll(fail, timeout_s=30.0, pause_s=0.0)
