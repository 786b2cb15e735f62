"""The clock: the system's in a service, one that is set by hand in a test."""

from __future__ import annotations

import time
from typing import Protocol

from shift_schemas.timestamps import Stamp


class Clock(Protocol):
    """The source of the current time."""

    def now(self) -> Stamp:
        """Return the wall-clock time since the Unix epoch."""


class SystemClock:
    """The machine's wall clock."""

    def now(self) -> Stamp:
        """See :class:`Clock`."""
        return Stamp.of(time.time_ns())


class ManualClock:
    """A clock that shows the time that it is set to."""

    def __init__(self, ns: int = 0) -> None:
        self.ns = ns

    def now(self) -> Stamp:
        """See :class:`Clock`."""
        return Stamp.of(self.ns)
