"""The counts and reasons that ``/shift/diagnostics`` publishes. Pure: the caller passes the time.

A text is published at most every ``interval_s`` seconds and only after a change: a million bad messages are one number.
"""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import dataclass, field
from typing import Any

from shift_schemas.errors import ShiftError, shorten

TOPICS = 32
"""Count at most this many topics separately, which bounds memory."""


@dataclass
class Diagnostics:
    """Counts of received and dropped messages since the start."""

    interval_s: float
    received: Counter[str] = field(default_factory=Counter)
    dropped: Counter[tuple[str, str]] = field(default_factory=Counter)
    state: str = "starting"
    _last: dict[str, Any] | None = None
    _news: bool = True
    _due_s: float = 0.0

    def count_received(self, topic: str, count: int = 1) -> None:
        """Count a received message; it alone causes no report."""
        self.received[topic] += count

    def count_lost(self, topic: str, error: ShiftError, count: int = 1, reason: str = "") -> None:
        """Count dropped or refused messages; the next report has the last reason."""
        key = (topic, reason or error.kind)
        if key not in self.dropped and len(self.dropped) >= TOPICS:
            key = ("other", "other")
        self.dropped[key] += count
        self._last = {
            "topic": topic, "reason": reason or error.kind, "detail": shorten_detail(error.detail),
            "errors": [e.model_dump() for e in error.errors[:3]],
        }  # fmt: skip
        self._news = True

    def set_state(self, state: str) -> None:
        """Set the state of the bridge: ``ready``, or what it waits for."""
        self._news = self._news or state != self.state
        self.state = state

    def report(self, now_s: float, **more: Any) -> str | None:
        """Return the text to publish, or None if nothing changed or it is too early."""
        if not self._news or now_s < self._due_s:
            return None
        self._news = False
        self._due_s = now_s + self.interval_s
        dropped: dict[str, dict[str, int]] = {}
        for (topic, reason), count in self.dropped.items():
            dropped.setdefault(topic, {})[reason] = count
        content = {"service": "ros2_bridge", **more, "state": self.state, "received": dict(self.received)}
        return json.dumps({**content, "dropped": dropped, "last": self._last})


def shorten_detail(detail: str) -> str:
    """Truncate the detail above 500 characters."""
    return detail if len(detail) <= 500 else shorten(detail)
