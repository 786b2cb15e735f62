"""A door's own read_model: the latest of every session, folded from all owners' facts.

Reads are answered from it. It has no journal: it reads the owners' from the start,
and until it has, it says that it does not know yet.
"""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

from shift_schemas.errors import Unavailable, UnknownThing
from shift_schemas.messages import (
    Config,
    Decision,
    Fact,
    Observation,
    Override,
    Performance,
    Policy,
    Seen,
    Session,
)
from shift_schemas.registry import OWNERS
from shift_study.loading import study_from_json
from shift_study.study import Study

from shift_runtime.bus.protocol import Bus
from shift_runtime.reader import Reader, ReadFact

NOTIFICATION_WAIT_S = 0.05
Listener = Callable[[Fact, str], None]


@dataclass
class SessionView:
    """One session as far as the replica has read, and what was answered through this door."""

    fact: Session
    config: Config | None = None
    observation: Observation | None = None
    policy: Policy | None = None
    decisions: dict[str, str] = field(default_factory=dict)
    """Decision id -> task."""
    performances: int = 0
    overrides: dict[str, Override] = field(default_factory=dict)
    n: int = 0
    counts: Counter[str] = field(default_factory=Counter)
    answered: Counter[str] = field(default_factory=Counter)
    """What this door has answered, as :class:`Seen` counts it: it is in everything that it answers afterwards."""
    sequences: dict[str, int] = field(default_factory=dict)
    """Per owner, the sequence that its last answer named."""
    listeners: list[Listener] = field(default_factory=list)
    changed: asyncio.Event = field(default_factory=asyncio.Event)

    @property
    def study(self) -> Study:
        """The study in force. Raises :class:`Unavailable` before it is known."""
        if self.config is None:
            raise Unavailable("the recorder has not published a configuration of this session yet; ask again")
        return study_from_json(self.config.study)

    @property
    def required(self) -> Seen:
        """What an answer must have in it: what this door answered, and what it has read."""
        answered = self.answered
        return Seen(
            decision=max(answered["decision"], self.n),
            performance=max(answered["performance"], self.performances),
            config=max(answered["config"], self.config.version if self.config else 1),
            observation=max(answered["observation"], self.observation.version if self.observation else 0),
        )


class ReadModel:
    """All sessions."""

    def __init__(
        self, bus: Bus, dropped: Callable[[str], None], lost: Callable[[str], None] = lambda owner: None
    ) -> None:
        self.views: dict[str, SessionView] = {}
        self.reader = Reader(bus, tuple(OWNERS), {}, self._deliver, dropped, closed=True, lost=lost)

    @property
    def missing(self) -> tuple[str, ...]:
        """Owners whose journals have not been read yet."""
        return tuple(sorted(set(OWNERS) - self.reader.synced))

    async def view(self, session: str) -> SessionView:
        """The session's view.

        Raises
        ------
        UnknownThing
            The recorder, asked just now, has no such session.
        Unavailable
            The recorder cannot be asked.
        """
        if self.missing:
            if "recorder" in self.missing:
                await self.reader.pull("recorder")
            await self.reader.pull_all(self.missing)
        if session not in self.views:
            if not await self.reader.pull("recorder"):
                raise Unavailable("the recorder does not answer, so nobody knows whether there is such a session")
            if session not in self.views:
                raise UnknownThing(f"there is no session {session}")
        return self.views[session]

    async def wait(self, session: str, owners: tuple[str, ...], there: Callable[[], bool], wait_s: float) -> bool:
        """Wait until ``there()``: for a hint first, then by pulling ``owners``; whether it came."""
        view = self.views[session]
        loop = asyncio.get_running_loop()
        start = loop.time()
        notification_until = start + min(NOTIFICATION_WAIT_S, wait_s / 2)
        while not there():
            left = start + wait_s - loop.time()
            if left <= 0:
                return False
            view.changed.clear()
            if loop.time() >= notification_until:
                await self.reader.pull_all(owners)
                if there():
                    return True
                notification_until = loop.time() + 4 * NOTIFICATION_WAIT_S
            try:
                pause = min(left, max(0.001, notification_until - loop.time()))
                await asyncio.wait_for(view.changed.wait(), pause)
            except TimeoutError:
                continue
        return True

    def has_read(self, session: str, owner: str) -> bool:
        """Whether all that ``owner`` answered through this door has been read back."""
        wanted = self.views[session].sequences.get(owner, 0)
        return self.reader.cursors.get((session, owner), 0) >= wanted

    def _deliver(self, read: ReadFact) -> None:
        fact = read.fact
        view = self.views.get(fact.session)
        if isinstance(fact, Session):
            if view is None:
                view = self.views[fact.session] = SessionView(fact)
            view.fact = fact
        if view is None:
            view = self._early(read)
            if view is None:
                return
        view.counts[fact.subject] += 1
        _fold(view, fact)
        view.changed.set()
        for listener in view.listeners:
            listener(fact, read.payload)

    def _early(self, read: ReadFact) -> SessionView | None:
        """A fact of a session that the recorder has not told of yet: it is read again once it has."""
        self.reader.cursors[read.fact.session, read.owner] = read.seq - 1
        self.reader.pull_soon("recorder")
        return None


def _fold(view: SessionView, fact: Fact) -> None:
    match fact:
        case Config():
            view.config = fact
        case Observation():
            view.observation = fact
        case Policy():
            view.policy = fact
        case Decision():
            view.n = fact.n
            view.decisions[fact.decision_id] = fact.task
            view.overrides.pop(fact.task, None)
        case Override():
            view.overrides[fact.task] = fact
        case Performance():
            view.performances = fact.n
