"""The disk alarm of a service: raised by a failed write, cleared by a successful one."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

import structlog
from shift_schemas.errors import Unavailable

log = structlog.get_logger()

CHECK_EVERY_S = 1.0
"""How often a disk that refused a write is tried again. The alarm must fall within 1 s (docs/reliability.md)."""


class DiskAlarm:
    """Whether the disk refuses writes, and why. While it does, the disk is tried every :data:`CHECK_EVERY_S`.

    Parameters
    ----------
    check
        Writes something harmless; raises :class:`Unavailable` where the disk still refuses.
    schedule
        Runs a function in the worker's turn.
    """

    def __init__(self, check: Callable[[], None], schedule: Callable[[Callable[[], None]], None]) -> None:
        self._try_disk = check
        self._schedule = schedule
        self._checking = False
        self.detail = ""
        """The disk's last error; empty while it takes writes."""

    def raise_alarm(self, error: Unavailable) -> None:
        """Raise the alarm. It is tried again on its own, for there may be nothing left to write that would notice."""
        self.detail = error.detail
        self._check_later()

    def clear_alarm(self) -> None:
        """Clear the alarm: something was written."""
        if self.detail:
            log.warning("the disk takes commits again")
            self.detail = ""

    def _check_later(self) -> None:
        if not self._checking:
            self._checking = True
            asyncio.get_running_loop().call_later(CHECK_EVERY_S, self._schedule, self._check)

    def _check(self) -> None:
        self._checking = False
        if not self.detail:
            return
        try:
            self._try_disk()
        except Unavailable as e:
            self.raise_alarm(e)
        else:
            self.clear_alarm()
