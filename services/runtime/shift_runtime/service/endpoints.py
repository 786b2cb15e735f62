"""A service's own endpoints: its outbox, its health and its metrics."""

from __future__ import annotations

from collections.abc import Callable, Sequence, Sized
from dataclasses import dataclass

from shift_schemas.codec import decode, encode
from shift_schemas.errors import MalformedMessage, Problem
from shift_schemas.keys import ServiceKey, build_key
from shift_schemas.messages import Health, OutboxQuery

from shift_runtime.bus.protocol import Bus, Request
from shift_runtime.claim import Claim
from shift_runtime.journal import Journal
from shift_runtime.metrics import Metrics
from shift_runtime.reader import Reader
from shift_runtime.service.disk_alarm import DiskAlarm
from shift_runtime.service.progress import Progress


@dataclass
class ServiceEndpoints:
    """Answers what others ask about a service itself."""

    service: str
    bus: Bus
    journal: Journal
    metrics: Metrics
    reader: Reader
    progress: Progress
    claim: Claim
    alarm: DiskAlarm
    states: Sized
    schedule: Callable[[Callable[[], None]], None]
    """Runs a function in the worker's turn: a worker that hangs must not report that it is healthy."""
    publish_for: Callable[[Sequence[str], Callable[[], None]], None]
    """Publishes what is held back of these sessions, and then calls the function."""
    _reported_overload: int = 0

    def declare(self) -> None:
        """Answer requests for the outbox, the health and the metrics."""
        self.bus.serve(build_key(ServiceKey(self.service, "outbox")), self._on_outbox)
        self.bus.serve(build_key(ServiceKey(self.service, "health")), self._on_health)
        self.bus.serve(build_key(ServiceKey(self.service, "metrics")), self._on_metrics)

    @property
    def ready(self) -> bool:
        """Whether every owner's journal was read and the disk takes commits."""
        return not self.alarm.detail and self.reader.synced >= set(self.reader.owners)

    def health(self) -> Health:
        """Return the service's health; ``detail`` is the first reason why it is not ready."""
        missing = sorted(set(self.reader.owners) - self.reader.synced)
        unreached = self.reader.links.unreached
        reasons = [
            self.alarm.detail,
            f"waits for the {', the '.join(missing)}" if missing else "",
            f"the {self.service} does not reach the {', the '.join(unreached)}" if unreached else "",
            self.claim.conflict,
            next(iter(self.reader.misfits.values()), ""),
        ]
        return Health(
            service=self.service, ready=self.ready and not any(reasons), detail=next(filter(None, reasons), ""),
            sessions=len(self.states), unreached=unreached, mesh=self.claim.mesh, since=self.claim.since,
            data=str(self.journal.data.absolute()),
        )  # fmt: skip

    def _on_outbox(self, request: Request) -> None:
        try:
            query = decode(OutboxQuery, request.payload)
        except MalformedMessage as e:
            self.metrics.dropped("malformed")
            request.refuse(encode(Problem.of(e)))
            return

        def reply() -> None:
            request.reply(encode(self.journal.page(query, self.progress.processed)))

        if query.current:
            self.publish_for(query.only or (), reply)
        else:
            reply()

    def _on_health(self, request: Request) -> None:
        self.schedule(lambda: request.reply(encode(self.health())))

    def _on_metrics(self, request: Request) -> None:
        dropped = self.bus.dropped
        self.metrics.dropped("overload", dropped - self._reported_overload)
        self._reported_overload = dropped
        self.metrics.sessions(len(self.states))
        for owner in self.reader.owners:
            self.metrics.silent(owner, self.reader.links.silent_s(owner))
        request.reply(self.metrics.text())
