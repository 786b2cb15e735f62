"""The clock is handed in: the system's in a service, a hand-set one in a test."""

from __future__ import annotations

import time
from typing import Protocol

from shift_schemas.timestamps import Stamp


class Clock(Protocol):
    """Says what time it is."""

    def now(self) -> Stamp:
        """Wall-clock time since the Unix epoch."""


class SystemClock:
    """The machine's wall clock."""

    def now(self) -> Stamp:
        """See :class:`Clock`."""
        return Stamp.of(time.time_ns())


class ManualClock:
    """A clock that stands where it is put."""

    def __init__(self, ns: int = 0) -> None:
        self.ns = ns

    def now(self) -> Stamp:
        """See :class:`Clock`."""
        return Stamp.of(self.ns)
