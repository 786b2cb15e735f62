"""Replay: publish the facts of a recording again, with their own timing, in a session of their own.

A replay is marked: the session's fact names the recording (``replay_of``), and each publication carries
``replay:SEQUENCE`` as its attachment. The readers of the services skip such publications (``shift_runtime.reader``).
So every tool that listens receives a replay, and no learner learns from it.
"""

from __future__ import annotations

import asyncio
import math
import secrets
from collections.abc import AsyncIterator, Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

from shift_runtime.bus.protocol import Bus
from shift_runtime.reader import REPLAY_MARK
from shift_schemas.codec import decode, encode, encoding_of
from shift_schemas.errors import Conflict, DamagedRecording, MalformedMessage, shorten
from shift_schemas.ids import is_id, not_an_id
from shift_schemas.keys import FactKey, ServiceKey, build_key
from shift_schemas.messages import Fact, OutboxPage, OutboxQuery, Session
from shift_schemas.registry import SUBJECTS
from shift_schemas.suggestions import did_you_mean
from shift_schemas.timestamps import NS

from shift_recording.mcap.reader import RecordedFact, Recording, recorded_fact

LONGEST_ID = 63
LONGEST_PAUSE_S = 10.0
"""The longest pause, s: longer than the pauses of an interaction, but no user waits through a lunch break. A choice."""
OnProgress = Callable[[float, int], None]
"""Called with the position in the recording, s, and the number of published facts."""


class Publish(Protocol):
    """Publishes a fact: :meth:`shift_runtime.bus.protocol.Bus.put`, or a function that waits instead of dropping."""

    def __call__(self, key: str, payload: bytes, /, *, encoding: str = "", attachment: bytes = b"") -> None:
        """Publish a fact."""


@dataclass(frozen=True)
class Replay:
    """The parts of a recording to replay, and how to replay them.

    Raises
    ------
    MalformedMessage
        A value is not valid.
    """

    path: Path
    session: str
    rate: float = 1.0
    start_offset_s: float = 0.0
    topics: tuple[str, ...] = SUBJECTS
    loop: bool = False
    longest_pause_s: float = LONGEST_PAUSE_S
    """A longer pause of the recording is shortened to this; 0: none is."""
    duration_s: float = 0.0
    """How much of the recording is replayed from the offset on, s; 0: all of it."""
    remap: Mapping[str, str] = field(default_factory=dict)
    """Topics that are published under the key of another topic's name, or under a new name."""

    def __post_init__(self) -> None:
        """Check the values."""
        if not is_id(self.session):
            raise MalformedMessage(not_an_id(self.session))
        if not 0 < self.rate <= 10_000:
            raise MalformedMessage(f"a speed of {self.rate:g} is not valid; write a number above 0, 1 for real time")
        if not 0 <= self.start_offset_s < 1e9:
            raise MalformedMessage(f"a start {self.start_offset_s:g} s into the recording cannot be")
        if not 0 <= self.duration_s < 1e9:
            raise MalformedMessage(f"a duration of {self.duration_s:g} s is not valid; write 0 for the whole recording")
        if wrong := [name for name in self.remap.values() if not is_id(name)]:
            raise MalformedMessage(f"--remap: {not_an_id(wrong[0])}")
        if not 0 <= self.longest_pause_s < 1e9:
            raise MalformedMessage(f"a longest pause of {self.longest_pause_s:g} s is not valid; write 0 for no limit")
        if unknown := [topic for topic in (*self.topics, *self.remap) if topic not in SUBJECTS]:
            known = f"there are {', '.join(SUBJECTS)}{did_you_mean(unknown[0], SUBJECTS)}"
            raise MalformedMessage(f"{shorten(unknown[0])!r} is not a topic; {known}")


@dataclass(frozen=True)
class Extent:
    """The session of a recording, and its length on its time line, s.

    ``shortened`` counts the pauses above the longest allowed pause; ``left_out_s`` is the sum of what they exceed it.
    """

    session: str
    length_s: float
    topics: Collection[str]
    shortened: int = 0
    left_out_s: float = 0.0


class TimeLine:
    """The positions of a recording's messages on its time line, s. Long pauses are shortened."""

    def __init__(self, longest_pause_s: float) -> None:
        self._longest_ns = round(longest_pause_s * NS)
        self._last: int | None = None
        self._at_ns = 0
        self.shortened = 0
        self.left_out_ns = 0

    def position_s(self, log_time: int) -> float:
        """Return the position of the next message."""
        passed = 0 if self._last is None else max(log_time - self._last, 0)
        if self._longest_ns and passed > self._longest_ns:
            self.shortened += 1
            self.left_out_ns += passed - self._longest_ns
            passed = self._longest_ns
        self._last = log_time
        self._at_ns += passed
        return self._at_ns / NS


class Pacer:
    """A clock with a rate that can be paused.

    Parameters
    ----------
    now
        Returns the seconds of a monotonic clock.
    """

    def __init__(self, rate: float, now: Callable[[], float], paused: bool = False) -> None:
        self._rate = rate
        self._now = now
        self._at = 0.0
        self._since: float | None = None if paused else now()
        self._changed = asyncio.Event()
        self._jump: float | None = None
        self._steps = 0

    @property
    def rate(self) -> float:
        """Recorded seconds in a second."""
        return self._rate

    @property
    def paused(self) -> bool:
        """Whether time stands still."""
        return self._since is None

    @property
    def position_s(self) -> float:
        """Recorded seconds that have passed."""
        return self._at if self._since is None else self._at + (self._now() - self._since) * self._rate

    def toggle(self) -> None:
        """Pause, or continue from this position."""
        self._at, self._since = self.position_s, (self._now() if self.paused else None)
        self._changed.set()

    def pause(self, paused: bool) -> None:
        """Pause or continue; nothing happens if it is so already."""
        if paused != self.paused:
            self.toggle()

    def step(self) -> None:
        """Pause, and let one more message pass."""
        self.pause(True)
        self._steps += 1
        self._changed.set()

    def jump(self, position_s: float) -> None:
        """Ask the player to go on from another position of the recording, which can be earlier."""
        self._jump = position_s
        self.seek(position_s)

    @property
    def is_jumping(self) -> bool:
        """Whether the player was asked to go on from another position."""
        return self._jump is not None

    def take_jump(self) -> float:
        """Return the position to go on from; the request is then carried out."""
        assert self._jump is not None
        position_s, self._jump = self._jump, None
        return position_s

    def seek(self, position_s: float) -> None:
        """Go to another position; a paused clock stays paused."""
        self._at, self._since = position_s, (None if self.paused else self._now())
        self._changed.set()

    def change_rate(self, rate: float) -> None:
        """Change the rate from this position on."""
        self.seek(self.position_s)
        self._rate = rate

    async def until(self, position_s: float) -> None:
        """Wait until the position is reached, until a step lets one message pass, or until a jump is asked for."""
        while not self.is_jumping and ((left_s := position_s - self.position_s) > 0 or self.paused):
            if self._steps:
                self._steps -= 1
                self._at = max(self._at, position_s)
                return
            self._changed.clear()
            wait = self._changed.wait()
            if self.paused:
                await wait
                continue
            try:
                await asyncio.wait_for(wait, left_s / self._rate)
            except TimeoutError:
                continue


def replay_session(recorded: str) -> str:
    """Return an unused session id for a replay of ``recorded``."""
    tail = secrets.token_hex(3)
    return f"replay-{recorded[: LONGEST_ID - len('replay-') - len(tail) - 1]}-{tail}"


def extent_of(path: Path, longest_pause_s: float = LONGEST_PAUSE_S) -> Extent:
    """Return the extent of a recording after one pass over it.

    Raises
    ------
    DamagedRecording
        The recording is damaged or has no messages.
    UnknownThing
        The file does not exist.
    """
    recording, line, length_s = Recording(path), TimeLine(longest_pause_s), 0.0
    topics = set()
    for message in recording.messages():
        length_s = line.position_s(message.log_time)
        topics.add(message.topic)
    session = recording.metadata.get("shift:session", {}).get("session", "")
    if not topics:
        raise DamagedRecording(f"{path.name} holds no messages")
    return Extent(session, length_s, frozenset(topics), line.shortened, line.left_out_ns / NS)


async def check_free(bus: Bus, session: str) -> None:
    """Raise :class:`Conflict` if the mesh has a session of that name, because a replay must not mix with a session."""
    query = OutboxQuery(only=[session])
    replies = await bus.get(build_key(ServiceKey("recorder", "outbox")), encode(query), timeout_s=1.0)
    for reply in (r for r in replies if r.ok):
        if decode(OutboxPage, reply.payload).heads.get(session, 0):
            raise Conflict(f"there is a session {session} already; name another one for the replay")


async def play(
    put: Publish, replay: Replay, extent: Extent, pacer: Pacer, on_progress: OnProgress | None = None
) -> int:
    """Publish each fact at its time, and return their number.

    It ends with the recording; with ``loop`` it ends only when it is cancelled. Raises as :meth:`Recording.facts`.
    """
    published = 0
    async for position_s, recorded in _timed(replay, extent, pacer):
        _publish(put, replay, recorded)
        published += 1
        if on_progress is not None:
            on_progress(position_s, published)
    return published


async def _timed(replay: Replay, extent: Extent, pacer: Pacer) -> AsyncIterator[tuple[float, RecordedFact]]:
    """Yield each fact at its time."""
    start_s = replay.start_offset_s
    while True:
        pacer.seek(start_s)
        count = 0
        for position_s, recorded in _from_offset(replay, start_s):
            await pacer.until(position_s)
            if pacer.is_jumping:
                break
            count += 1
            yield position_s, recorded
            if count % 256 == 0:
                await asyncio.sleep(0)
        if not pacer.is_jumping:
            if not replay.loop or not count:
                return
            await pacer.until(min(extent.length_s, _end_s(replay)))
            await asyncio.sleep(0)
        start_s = pacer.take_jump() if pacer.is_jumping else replay.start_offset_s


def _end_s(replay: Replay) -> float:
    return replay.start_offset_s + replay.duration_s if replay.duration_s else math.inf


def _from_offset(replay: Replay, start_s: float) -> Iterator[tuple[float, RecordedFact]]:
    line = TimeLine(replay.longest_pause_s)
    for message in Recording(replay.path).messages():
        position_s = line.position_s(message.log_time)
        if position_s > _end_s(replay):
            return
        if position_s >= start_s and message.topic in replay.topics:
            yield position_s, recorded_fact(replay.path, message)


def _publish(put: Publish, replay: Replay, recorded: RecordedFact) -> None:
    fact = replayed(recorded.fact, replay)
    put(
        key_of(replay, fact.subject),
        encode(fact),
        encoding=encoding_of(type(fact)),
        attachment=REPLAY_MARK + str(recorded.sequence).encode(),
    )


def key_of(replay: Replay, subject: str) -> str:
    """Return the key under which the facts of a subject are published."""
    key = build_key(FactKey(replay.session, subject))
    return f"{key.rpartition('/')[0]}/{replay.remap[subject]}" if subject in replay.remap else key


def replayed(fact: Fact, replay: Replay) -> Fact:
    """Return the fact as it is replayed: it belongs to another session, which names the recording."""
    update = {"session": replay.session}
    if isinstance(fact, Session):
        update["replay_of"] = replay.path.name
    return fact.model_copy(update=update)
