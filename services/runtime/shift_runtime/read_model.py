"""The read model: the latest of every session, folded from the facts of all owners.

Reads are answered from it. It has no journal of its own: it reads the owners' journals from the start, and reports that
it does not know yet until it has read them.
"""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from shift_schemas.errors import Unavailable, UnknownThing
from shift_schemas.messages import (
    Config,
    Decision,
    Fact,
    Gaze,
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
from shift_runtime.deadline import Deadline
from shift_runtime.reader import ReadFact
from shift_runtime.sharded_reader import ShardedReader

NOTIFICATION_WAIT_S = 0.05
"""How long a read waits for a notification before it pulls the owners' journals."""
Listener = Callable[[Fact, str], None]


@dataclass
class SessionView:
    """One session as far as the read model has read it, and what its clients were answered."""

    fact: Session
    config: Config | None = None
    observation: Observation | None = None
    policy: Policy | None = None
    decisions: dict[str, str] = field(default_factory=dict)
    """Each decision id with its task."""
    made: set[str] = field(default_factory=set)
    """The ids of decisions that clients were answered, read or not."""
    performances: int = 0
    overrides: dict[str, Override] = field(default_factory=dict)
    held: bool = False
    """Whether gaze was read that no observation shows yet: the monitor holds it back until somebody asks."""
    n: int = 0
    counts: Counter[str] = field(default_factory=Counter)
    answered: Counter[str] = field(default_factory=Counter)
    """What clients were answered, counted as :class:`Seen` does: every later answer includes it."""
    sequences: dict[str, int] = field(default_factory=dict)
    """Per owner, the sequence of its last answer."""
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
        """What an answer must include: what clients were answered, and what has been read."""
        answered = self.answered
        return Seen(
            decision=max(answered["decision"], self.n),
            performance=max(answered["performance"], self.performances),
            config=max(answered["config"], self.config.version if self.config else 1),
            observation=max(answered["observation"], self.observation.version if self.observation else 0),
        )


class ReadModel:
    """All sessions. ``buses`` has the bus of each shard."""

    def __init__(
        self, buses: Sequence[Bus], dropped: Callable[[str], None], lost: Callable[[str], None] = lambda owner: None
    ) -> None:
        self.views: dict[str, SessionView] = {}
        self.reader = ShardedReader(buses, tuple(OWNERS), self._deliver, dropped, lost)

    @property
    def missing(self) -> tuple[str, ...]:
        """Owners whose journals have not been read yet."""
        return tuple(sorted(set(OWNERS) - self.reader.synced))

    async def view(self, session: str) -> SessionView:
        """Return the session's view.

        Raises
        ------
        UnknownThing
            The recorder, asked just now, has no such session.
        Unavailable
            The recorder does not answer.
        """
        if self.missing:
            if "recorder" in self.missing:
                await self.reader.pull("recorder")
            await self.reader.pull_all(self.missing)
        if session not in self.views:
            if not await self.reader.pull("recorder"):
                raise Unavailable(f"the recorder does not answer, so it is not known whether session {session} exists")
            if session not in self.views:
                raise UnknownThing(f"there is no session {session}")
        return self.views[session]

    async def wait(self, session: str, owners: tuple[str, ...], there: Callable[[], bool], wait_s: float) -> bool:
        """Wait until ``there()``, at most ``wait_s`` seconds. Return whether it is.

        Notifications are awaited first; then the journals of ``owners`` are pulled again and again.
        """
        changed = self.views[session].changed
        next_pull = Deadline(min(NOTIFICATION_WAIT_S, wait_s / 2))
        try:
            async with asyncio.timeout(wait_s):
                while not there():
                    changed.clear()
                    if not await next_pull.is_set(changed):
                        await self.reader.pull_all(owners)
                        next_pull = Deadline(4 * NOTIFICATION_WAIT_S)
        except TimeoutError:
            return there()
        return True

    async def show(self, session: str) -> None:
        """Read what the monitor holds back of the session, where it holds back something that was answered or read."""
        view = self.views[session]
        shown = view.observation.version if view.observation else 0
        if view.held or shown < view.answered["observation"]:
            await self.reader.pull("monitor", session, current=True)

    def has_read(self, session: str, owner: str) -> bool:
        """Return whether the read model has all facts of ``owner`` that clients were answered."""
        wanted = self.views[session].sequences.get(owner, 0)
        return (self.reader.cursor(session, owner) or 0) >= wanted

    def _deliver(self, read: ReadFact) -> None:
        fact = read.fact
        view = self.views.get(fact.session)
        if isinstance(fact, Session):
            if view is None:
                view = self.views[fact.session] = SessionView(fact)
            view.fact = fact
        if view is None:
            self._defer(read)
            return
        view.counts[fact.subject] += 1
        _fold(view, fact)
        view.changed.set()
        for listener in tuple(view.listeners):
            listener(fact, read.payload)

    def _defer(self, read: ReadFact) -> None:
        """Read the fact again after the recorder has published its session."""
        self.reader.read_again(read)


def _fold(view: SessionView, fact: Fact) -> None:
    match fact:
        case Config():
            view.config = fact
        case Observation():
            view.observation, view.held = fact, False
        case Gaze():
            view.held = True
        case Policy():
            view.policy = fact
        case Decision():
            view.n = fact.n
            view.decisions[fact.decision_id] = fact.task
            view.overrides.pop(fact.task, None)
        case Override(withdraws=""):
            view.overrides[fact.task] = fact
        case Override():
            view.overrides.pop(fact.task, None)
        case Performance():
            view.performances = fact.n
