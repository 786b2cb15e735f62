"""An owner of facts that a test plays: it has an outbox, it publishes, and it can stop and come back."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field

from shift_runtime.bus.protocol import Bus, Handle, Request
from shift_schemas.codec import decode, encode
from shift_schemas.keys import FactKey, ServiceKey, build_key
from shift_schemas.messages import Fact, OutboxPage, OutboxQuery, OutboxRow

from support.runtime_fixtures import marker


@dataclass
class Owner:
    """An owner with pages of at most ``most`` rows."""

    bus: Bus
    name: str
    most: int = 10_000
    rows: dict[str, list[OutboxRow]] = field(default_factory=dict)
    asked: list[OutboxQuery] = field(default_factory=list)
    _served: Handle | None = None

    def live(self) -> Owner:
        """Answer requests for the outbox."""
        self._served = self.bus.serve(build_key(ServiceKey(self.name, "outbox")), self._page)
        return self

    def die(self) -> None:
        """Answer nothing any more."""
        assert self._served is not None
        self._served.close()

    def publish(self, *facts: Fact, notify: bool = True) -> None:
        """Add facts to the outbox and notify the readers."""
        for fact in facts:
            rows = self.rows.setdefault(fact.session, [])
            payload = fact.model_dump_json()
            rows.append(OutboxRow(session=fact.session, seq=len(rows) + 1, subject=fact.subject, payload=payload))
            if notify:
                self.notify(len(rows), fact.session)

    def commit(self, count: int, session: str = "s1") -> None:
        """Add so many markers to the outbox without a notification."""
        first = len(self.rows.setdefault(session, [])) + 1
        self.publish(*(marker(n, session) for n in range(first, first + count)), notify=False)

    def notify(self, seq: int, session: str = "s1") -> None:
        """Publish a fact of the outbox, perhaps once more."""
        found = self.rows[session][seq - 1]
        self.bus.put(build_key(FactKey(session, found.subject)), found.payload.encode(), attachment=str(seq).encode())

    def _page(self, request: Request) -> None:
        query = decode(OutboxQuery, request.payload)
        self.asked.append(query)
        wanted = self.rows if query.only is None else {s: self.rows.get(s, []) for s in query.only}
        rows = list(itertools.chain.from_iterable(found[query.cursors.get(s, 0) :] for s, found in wanted.items()))
        heads = {s: len(found) for s, found in wanted.items()}
        page = OutboxPage(owner=self.name, rows=rows[: self.most], heads=heads, complete=len(rows) < self.most)
        request.reply(encode(page))
