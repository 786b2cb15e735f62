"""The disk alarm: a disk that refused is tried until it takes a write."""

from __future__ import annotations

import pytest
from shift_runtime.service import disk_alarm as module
from shift_runtime.service.disk_alarm import DiskAlarm
from shift_schemas.errors import Unavailable
from support.runtime_fixtures import until
from support.service_parts import Schedule

pytestmark = pytest.mark.anyio
FULL = Unavailable("the disk is full")


class Disk:
    """A disk that is full or not."""

    def __init__(self) -> None:
        self.full = True
        self.tried = 0

    def check(self) -> None:
        self.tried += 1
        if self.full:
            raise Unavailable(f"the disk is full, at try {self.tried}")


@pytest.fixture(autouse=True)
def soon(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "CHECK_EVERY_S", 0.002)


async def test_alarm_stays_while_the_disk_refuses_and_is_cleared_by_the_first_write() -> None:
    disk, schedule = Disk(), Schedule()
    alarm = DiskAlarm(disk.check, schedule)
    assert alarm.detail == ""
    alarm.raise_alarm(FULL)
    assert alarm.detail == "the disk is full"
    for n in (1, 2):
        await until(lambda: schedule.items)
        schedule.run()
        assert alarm.detail == f"the disk is full, at try {n}"
    disk.full = False
    await until(lambda: schedule.items)
    schedule.run()
    assert alarm.detail == ""
    assert disk.tried == 3


async def test_several_alarms_try_the_disk_once() -> None:
    disk, schedule = Disk(), Schedule()
    alarm = DiskAlarm(disk.check, schedule)
    for _ in range(3):
        alarm.raise_alarm(FULL)
    await until(lambda: schedule.items)
    assert len(schedule.items) == 1


async def test_alarm_that_a_commit_cleared_needs_no_try() -> None:
    disk, schedule = Disk(), Schedule()
    alarm = DiskAlarm(disk.check, schedule)
    alarm.raise_alarm(FULL)
    alarm.clear_alarm()
    await until(lambda: schedule.items)
    schedule.run()
    assert disk.tried == 0
    alarm.raise_alarm(FULL)
    await until(lambda: schedule.items)
