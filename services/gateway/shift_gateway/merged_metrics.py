"""The metrics of all services as one exposition text, with one family for each name."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from prometheus_client import CollectorRegistry, generate_latest
from prometheus_client.core import Metric
from prometheus_client.parser import text_string_to_metric_families


class _Merged:
    def __init__(self, texts: Iterable[bytes]) -> None:
        self.texts = list(texts)

    def collect(self) -> Iterator[Metric]:
        families: dict[str, Metric] = {}
        for text in self.texts:
            for family in text_string_to_metric_families(text.decode()):
                known = families.setdefault(family.name, Metric(family.name, family.documentation, family.type))
                known.samples += family.samples
        yield from families.values()


def merged_metrics(texts: Iterable[bytes]) -> bytes:
    """Return the metrics of several exposition texts as one."""
    registry = CollectorRegistry()
    registry.register(_Merged(texts))
    return generate_latest(registry)
