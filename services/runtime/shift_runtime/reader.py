"""The reader: how every service, gateway and bridge reads the facts of another service.

A publication is only a notification. A reader accepts exactly the fact cursor + 1 of each owner and session, and pulls
the others from the owner's outbox: at the start, at once on a gap, every half second, and on request. So no fact is
missed or read twice, whatever the network does.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import structlog
from shift_schemas.codec import decode, encode
from shift_schemas.errors import MalformedMessage
from shift_schemas.keys import ROOT, FactKey, ServiceKey, build_key, parse_key
from shift_schemas.messages import Fact, OutboxPage, OutboxQuery, OutboxRow, Session
from shift_schemas.registry import FACTS, OWNER_OF, OWNERS

from shift_runtime.bus.protocol import Bus, Incoming, Reply, first_answer
from shift_runtime.links import Links
from shift_runtime.polling import poll

log = structlog.get_logger()

PULL_EVERY_S = 0.5
PULL_TIMEOUT_S = 1.0
FIRST_WAIT_S, FIRST_PAUSE_S = 1.0, 0.05
"""How long the session owner is asked at the start before the others are read without it; chosen: a short start."""
SESSION_OWNER = Session.owner
"""The owner whose facts say that a session exists."""
REPLAY_MARK = b"replay:"
"""The prefix of a replayed fact's sequence number. Tools that listen receive it; a reader ignores it."""


class Pull(NamedTuple):
    """What is pulled: an owner's outbox, one session of it, and first what the owner holds back of that session."""

    owner: str
    session: str | None = None
    current: bool = False


@dataclass(frozen=True)
class ReadFact:
    """A fact that was read, in its owner's order."""

    owner: str
    seq: int
    fact: Fact
    payload: str


def fact_of(row: OutboxRow) -> Fact:
    """Return the fact of an outbox row. Raise :class:`MalformedMessage` for an invalid row."""
    kind = FACTS.get(row.subject)
    if kind is None:
        raise MalformedMessage(f"{row.subject!r} is not a subject of this mesh")
    fact = decode(kind, row.payload)
    if fact.session != row.session:
        raise MalformedMessage(f"a {row.subject} of session {fact.session} under session {row.session}")
    return fact


@dataclass
class Reader:
    """Reads the facts of ``owners`` and passes each one to ``deliver``, in its owner's order.

    ``cursors`` holds the last sequence number delivered by session and owner; it starts where the caller had read to.
    ``dropped`` is called with the reason for each publication that is not a valid fact.
    """

    bus: Bus
    owners: tuple[str, ...]
    cursors: dict[tuple[str, str], int]
    deliver: Callable[[ReadFact], None]
    dropped: Callable[[str], None]
    closed: bool = False
    """Whether ended sessions are read as well."""
    done: set[str] = field(default_factory=set)
    """Sessions that are not read any more."""
    synced: set[str] = field(default_factory=set)
    """Owners whose outbox was read to its end at least once."""
    pages: dict[str, OutboxPage] = field(default_factory=dict)
    misfits: dict[tuple[str, str], str] = field(default_factory=dict)
    """By owner and session, a sentence if the owner's journal is older than what was read of it."""
    lost: Callable[[str], None] = lambda owner: None
    """Called with each owner that does not answer any more."""
    _pulls: dict[Pull, asyncio.Task[bool]] = field(default_factory=dict)
    _again: set[Pull] = field(default_factory=set)

    def __post_init__(self) -> None:
        """Set up the links to the owners."""
        self.links = Links(self.bus, self.owners, lambda owner: self.lost(owner))

    def start(self) -> None:
        """Subscribe to the notifications."""
        for owner in self.owners:
            for subject in OWNERS[owner]:
                self.bus.subscribe(f"{ROOT}/*/{subject}", self._on_notification)

    async def run(self) -> None:
        """Pull every owner without end. The owner of sessions comes first, since no session is known before."""
        if SESSION_OWNER in self.owners:
            await poll(lambda: self.pull(SESSION_OWNER), timeout_s=FIRST_WAIT_S, pause_s=FIRST_PAUSE_S)
        while True:
            await asyncio.gather(*(self.pull(owner) for owner in self.owners))
            await self.links.keep(self.pull)
            await asyncio.sleep(PULL_EVERY_S)

    def forget(self, session: str) -> None:
        """Stop reading a session that has ended."""
        self.done.add(session)
        for owner in self.owners:
            self.cursors.pop((session, owner), None)

    def _on_notification(self, incoming: Incoming) -> None:
        try:
            key = parse_key(incoming.key)
            if not isinstance(key, FactKey):
                raise MalformedMessage(f"{incoming.key} is not the key of a fact")
            number = incoming.attachment.removeprefix(REPLAY_MARK)
            if not number.isdigit() or len(number) > 15:
                raise MalformedMessage(f"a message of {key.subject} has no sequence number")
            row = OutboxRow(
                session=key.session,
                seq=int(number),
                subject=key.subject,
                payload=incoming.payload.decode(),
            )
            fact = fact_of(row)
        except (MalformedMessage, UnicodeDecodeError, ValueError):
            self.dropped("malformed")
            return
        if incoming.attachment.startswith(REPLAY_MARK):
            return
        owner = OWNER_OF[key.subject]
        if owner not in self.owners or row.session in self.done:
            return
        if row.seq > self.cursors.get((row.session, owner), 0) + 1:
            self.pull_soon(owner)
            return
        self._take(owner, row, fact)

    def _take(self, owner: str, row: OutboxRow, fact: Fact | None = None) -> None:
        if row.session in self.done or row.seq != self.cursors.get((row.session, owner), 0) + 1:
            return
        read = ReadFact(owner, row.seq, fact if fact is not None else fact_of(row), row.payload)
        self.cursors[row.session, owner] = row.seq
        self.deliver(read)

    def pull_soon(self, owner: str, session: str | None = None, current: bool = False) -> asyncio.Task[bool]:
        """Pull in the background; a request during a pull causes one more pull after it.

        With ``current``, the owner first publishes what it holds back of ``session``.
        """
        key = Pull(owner, session, current)
        running = self._pulls.get(key)
        if running is not None and not running.done():
            self._again.add(key)
            return running
        task = asyncio.get_running_loop().create_task(self._pull_until_current(key))
        self._pulls[key] = task
        return task

    async def pull(self, owner: str, session: str | None = None, current: bool = False) -> bool:
        """Read the owner's outbox to its end; return whether it answered."""
        return await asyncio.shield(self.pull_soon(owner, session, current))

    async def pull_all(self, owners: Iterable[str], session: str | None = None) -> tuple[str, ...]:
        """Pull several owners; return those that did not answer."""
        wanted = [o for o in owners if o in self.owners]
        answered = await asyncio.gather(*(self.pull(o, session) for o in wanted))
        return tuple(o for o, ok in zip(wanted, answered, strict=True) if not ok)

    async def _pull_until_current(self, key: Pull) -> bool:
        while True:
            self._again.discard(key)
            answered = await self._pull(*key)
            if key not in self._again or not answered:
                return answered

    async def _pull(self, owner: str, session: str | None, current: bool) -> bool:
        knows_sessions = owner == SESSION_OWNER or SESSION_OWNER in self.synced or SESSION_OWNER not in self.owners
        past: dict[str, int] = {}
        """Heads of sessions that are done: an owner that has not closed them yet would send them from their start."""
        while True:
            cursors = {s: n for (s, o), n in self.cursors.items() if o == owner and session in (None, s)}
            query = OutboxQuery(
                cursors=cursors | past,
                only=None if session is None else [session],
                closed=self.closed and owner == SESSION_OWNER,
                current=current,
            )
            page = await self._page(owner, query)
            if page is None:
                return False
            self.links.answered(owner)
            self._compare(owner, page, cursors)
            if not self._taken(owner, page):
                return False
            past |= {s: n for s, n in page.heads.items() if s in self.done}
            if session is not None:
                self.pages[f"{owner}/{session}"] = page
            if page.complete:
                if session is None and knows_sessions:  # otherwise a session's facts may have been deferred
                    self.synced.add(owner)
                return True

    def _compare(self, owner: str, page: OutboxPage, asked: Mapping[str, int]) -> None:
        """Report a journal that is older than what was read of it: its folder was copied while a mesh used it."""
        for session, read in asked.items():  # as of the request: notifications may have come meanwhile
            head = page.heads.get(session, 0)
            if read <= head:
                self.misfits.pop((owner, session), None)
            elif (owner, session) not in self.misfits:
                said = (
                    f"session {session}: the {owner}'s journal ends at message {head}, and {read} of its messages were "
                    "read before: the data folder was copied while a mesh used it; stop the mesh and copy the folder "
                    "again, or go on with the original"
                )
                self.misfits[owner, session] = said
                log.error("journals do not fit together", detail=said)

    def _taken(self, owner: str, page: OutboxPage) -> bool:
        """Deliver a page; return whether to continue. Deferred facts are requested later, not at once."""
        try:
            for row in page.rows:
                self._take(owner, row)
        except MalformedMessage:
            self.dropped("malformed")
            return False
        return page.complete or all(
            r.session in self.done or self.cursors.get((r.session, owner), 0) >= r.seq for r in page.rows
        )

    async def _page(self, owner: str, query: OutboxQuery) -> OutboxPage | None:
        key = build_key(ServiceKey(owner, "outbox"))
        return await first_answer(self.bus, key, encode(query), timeout_s=PULL_TIMEOUT_S, read=self._page_of)

    def _page_of(self, reply: Reply) -> OutboxPage | None:
        try:
            return decode(OutboxPage, reply.payload) if reply.ok else None
        except MalformedMessage:
            self.dropped("malformed")
            return None
