"""Requests to the services of the mesh.

A command is sent again with the same id until its reply comes or its time is up; the id makes that safe. No reply is a
failure that names the service, never a success.
"""

from __future__ import annotations

import asyncio
from collections.abc import Sequence

from shift_schemas.codec import M, decode, encode
from shift_schemas.errors import MalformedMessage, Problem, Unavailable, UnknownThing
from shift_schemas.keys import EVERY_REPLAY, CommandKey, ReplayKey, ServiceKey, StreamKey, build_key
from shift_schemas.messages import Answer, Command, Health, ReplayControl, ReplayStatus, StreamItem
from shift_schemas.registry import OWNERS
from shift_schemas.shards import Shard, shard_of

from shift_runtime.bus.protocol import Bus, Reply, first_answer
from shift_runtime.claim import healths_of, one_health
from shift_runtime.deadline import Deadline

ATTEMPT_S = 1.0
"""The longest time of one attempt: a request that a dying router loses gets no answer."""
PAUSE_S = 0.05
"""The pause between two attempts."""


class MeshClient:
    """Asks the services of every shard.

    Parameters
    ----------
    buses
        The bus of each shard.
    patience_s
        How long a service may take to come back, s.
    """

    def __init__(self, buses: Sequence[Bus], patience_s: float = 4.0) -> None:
        self.buses = buses
        self.patience_s = patience_s

    async def command(self, command: Command, wait_s: float = 0.0) -> Answer:
        """Carry out a command.

        Parameters
        ----------
        wait_s
            How long the service itself may wait before it answers (``decider.wait_s``), seconds.

        Raises
        ------
        ShiftError
            The service's refusal, or :class:`Unavailable` if it did not answer.
        """
        key = build_key(CommandKey(command.session, command.procedure))
        return await self._ask(command.session, key, encode(command), command.owner, wait_s)

    def bus_of(self, session: str) -> Bus:
        """Return the bus of the session's shard."""
        return self.buses[shard_of(session, len(self.buses))]

    async def send(self, session: str, item: StreamItem) -> Answer:
        """Send an item of a stream, such as a chunk of gaze; its service answers once the item is committed."""
        key = build_key(StreamKey(session, item.stream))
        return await self._ask(session, key, encode(item), item.owner, 0.0)

    async def healths(self, timeout_s: float = 1.0) -> dict[str, Health | None]:
        """Return the health of each owner's worker, None for one that does not answer.

        With several shards the names are those of the workers, such as ``monitor 0/4``.
        """
        asked = [(owner, index) for index in range(len(self.buses)) for owner in OWNERS]
        found = await asyncio.gather(*(self._health(self.buses[index], owner, timeout_s) for owner, index in asked))
        return {self._worker(owner, index): health for (owner, index), health in zip(asked, found, strict=True)}

    async def metrics(self, service: str, timeout_s: float = 1.0) -> list[bytes]:
        """Return the metrics of each of the service's workers that answers."""
        key = build_key(ServiceKey(service, "metrics"))
        asked = [first_answer(bus, key, timeout_s=timeout_s, read=_payload_of) for bus in self.buses]
        return [text for text in await asyncio.gather(*asked) if text]

    async def replays(self, timeout_s: float = 1.0) -> list[ReplayStatus]:
        """Return the status of each replay that runs."""
        asked = [bus.get(EVERY_REPLAY, timeout_s=timeout_s) for bus in self.buses]
        replies = [reply for found in await asyncio.gather(*asked) for reply in found if reply.ok]
        found = [status for reply in replies if (status := _decoded(ReplayStatus, reply)) is not None]
        return sorted(found, key=lambda status: status.session)

    async def control_replay(self, session: str, control: ReplayControl | None = None) -> ReplayStatus:
        """Control a replay and return its status after that; without a control only its status.

        Raises
        ------
        UnknownThing
            No such replay runs.
        ShiftError
            The replay refuses the control.
        """
        payload = encode(control) if control is not None else b""
        bus, key = self.bus_of(session), build_key(ReplayKey(session))
        answer = await first_answer(bus, key, payload, timeout_s=ATTEMPT_S, read=_replay_of)
        if isinstance(answer, Problem):
            raise answer.error()
        if isinstance(answer, ReplayStatus):
            return answer
        raise UnknownThing(f"no replay runs under session {session}")

    def _worker(self, owner: str, index: int) -> str:
        return owner if len(self.buses) == 1 else f"{owner} {Shard(index, len(self.buses))}"

    async def _health(self, bus: Bus, service: str, timeout_s: float) -> Health | None:
        replies = await bus.get(build_key(ServiceKey(service, "health")), timeout_s=timeout_s)
        return one_health(service, list(healths_of(replies)))

    async def _ask(self, session: str, key: str, payload: bytes, owner: str, wait_s: float) -> Answer:
        bus = self.bus_of(session)
        deadline = Deadline(self.patience_s + wait_s)
        while (left_s := deadline.left_s) > 0:
            answer = await first_answer(bus, key, payload, timeout_s=min(left_s, ATTEMPT_S), read=_answer_of)
            if isinstance(answer, Problem):
                raise answer.error()
            if isinstance(answer, Answer):
                return answer
            await asyncio.sleep(PAUSE_S)
        raise Unavailable(f"the {owner} does not answer")


def _replay_of(reply: Reply) -> ReplayStatus | Problem | None:
    return _decoded(ReplayStatus, reply) if reply.ok else _decoded(Problem, reply)


def _payload_of(reply: Reply) -> bytes | None:
    return reply.payload if reply.ok else None


def _answer_of(reply: Reply) -> Answer | Problem | None:
    return _decoded(Answer, reply) if reply.ok else _decoded(Problem, reply)


def _decoded(kind: type[M], reply: Reply) -> M | None:
    try:
        return decode(kind, reply.payload)
    except MalformedMessage:  # not a reply of this mesh: Zenoh reports "Timeout" in this way
        return None
