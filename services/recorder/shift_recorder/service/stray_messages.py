"""Stray messages: publications that no service subscribes to are counted as malformed."""

from __future__ import annotations

from shift_runtime.bus.protocol import Bus, Incoming
from shift_runtime.metrics import Metrics
from shift_schemas.errors import MalformedMessage
from shift_schemas.keys import ROOT, FactKey, StreamKey, parse_key


class StrayMessages:
    """Counts what is published under a key that is not of the mesh, of a command, or of a service's own endpoint."""

    def __init__(self, bus: Bus, metrics: Metrics) -> None:
        self._bus = bus
        self._metrics = metrics

    def declare(self) -> None:
        """Listen to everything under the mesh's root."""
        self._bus.subscribe(f"{ROOT}/**", self._count)
        self._bus.subscribe(f"{ROOT}/@service/**", self._count)  # a star matches no part that begins with @

    def _count(self, incoming: Incoming) -> None:
        try:
            key = parse_key(incoming.key)
        except MalformedMessage:
            key = None
        if not isinstance(key, FactKey | StreamKey):
            self._metrics.dropped("malformed")
