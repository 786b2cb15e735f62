"""The metrics of one process, in its own registry. The gateway merges them under ``/metrics``."""

from __future__ import annotations

from functools import cache

from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, disable_created_metrics, generate_latest

_bound = cache(Counter.labels)
"""A counter with its labels; looking it up again costs as much as counting."""

disable_created_metrics()  # type: ignore[no-untyped-call] # a second series per counter, which nobody uses


class Metrics:
    """The counters of a service; each has the label ``service``."""

    def __init__(self, service: str) -> None:
        self.service = service
        self.registry = CollectorRegistry()
        self._dropped = self._counter("shift_messages_dropped", "Messages dropped, by reason.", ("reason",))
        self._facts = self._counter("shift_facts_published", "Facts committed and published.", ("subject",))
        self._commands = self._counter("shift_commands", "Commands answered.", ("procedure", "outcome"))
        self._read = self._counter("shift_facts_read", "Facts of other services taken in.", ("subject",))
        self._failed = self._counter("shift_commits_failed", "Commits that the disk refused.", ())
        self._links_lost = self._counter("shift_links_lost", "Owners that did not answer any more.", ("owner",))
        self._silent = Gauge(
            "shift_owner_silent_seconds", "Time since an owner last answered.", ("service", "owner"),
            registry=self.registry,
        )  # fmt: skip
        self._sessions = Gauge("shift_sessions", "Sessions in memory.", ("service",), registry=self.registry).labels(
            service
        )
        self.commit_seconds = Histogram(
            "shift_commit_seconds", "Duration of a commit.", ("service",), registry=self.registry,
            buckets=(0.0001, 0.0003, 0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0),
        ).labels(service)  # fmt: skip
        for reason in ("malformed", "refused", "overload"):
            self._dropped.labels(service, reason)

    def _counter(self, name: str, text: str, labels: tuple[str, ...]) -> Counter:
        return Counter(name, text, ("service", *labels), registry=self.registry)

    def dropped(self, reason: str, count: int = 1) -> None:
        """Count dropped messages."""
        self._dropped.labels(self.service, reason).inc(count)

    def published(self, subject: str) -> None:
        """Count a fact that was committed and published."""
        _bound(self._facts, self.service, subject).inc()

    def read(self, subject: str) -> None:
        """Count a fact of another service that was read."""
        _bound(self._read, self.service, subject).inc()

    def answered(self, procedure: str, outcome: str) -> None:
        """Count a command that was answered."""
        _bound(self._commands, self.service, procedure, outcome).inc()

    def link_lost(self, owner: str) -> None:
        """Count an owner that does not answer any more."""
        self._links_lost.labels(self.service, owner).inc()

    def silent(self, owner: str, seconds: float) -> None:
        """Set how long ago an owner last answered, in seconds."""
        self._silent.labels(self.service, owner).set(seconds)

    def commit_failed(self) -> None:
        """Count a commit that the disk refused."""
        self._failed.labels(self.service).inc()

    def sessions(self, count: int) -> None:
        """Set how many sessions are in memory."""
        self._sessions.set(count)

    def text(self) -> bytes:
        """Return the metrics in Prometheus' text format."""
        return generate_latest(self.registry)
