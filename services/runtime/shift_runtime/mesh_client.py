"""Requests to the services of the mesh.

A command is sent again with the same id until its reply comes or its time is up; the id makes that safe. No reply is a
failure that names the service, never a success.
"""

from __future__ import annotations

import asyncio

from shift_schemas.codec import M, decode, encode
from shift_schemas.errors import MalformedMessage, Problem, Unavailable
from shift_schemas.keys import CommandKey, ServiceKey, StreamKey, build_key
from shift_schemas.messages import Answer, Command, GazeChunk, Health

from shift_runtime.bus.protocol import Bus, Reply, first_answer
from shift_runtime.claim import healths_of, one_health
from shift_runtime.deadline import Deadline

ATTEMPT_S = 1.0
"""The longest time of one attempt: a request that a dying router loses gets no answer."""
PAUSE_S = 0.05
"""The pause between two attempts."""


class MeshClient:
    """Asks services over ``bus``. ``patience_s`` is how long a service may take to come back."""

    def __init__(self, bus: Bus, patience_s: float = 4.0) -> None:
        self.bus = bus
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
        return await self._ask(key, encode(command), command.owner, wait_s)

    async def gaze(self, session: str, chunk: GazeChunk) -> Answer:
        """Send a chunk to the monitor; it answers once the chunk is committed."""
        return await self._ask(build_key(StreamKey(session, chunk.stream)), encode(chunk), chunk.owner, 0.0)

    async def health(self, service: str, timeout_s: float = 1.0) -> Health | None:
        """Return the health that the service's worker reports; None if it does not answer."""
        replies = await self.bus.get(build_key(ServiceKey(service, "health")), timeout_s=timeout_s)
        return one_health(service, list(healths_of(replies)))

    async def metrics(self, service: str, timeout_s: float = 1.0) -> bytes:
        """Return the service's metrics; empty if it does not answer."""
        key = build_key(ServiceKey(service, "metrics"))
        found = await first_answer(self.bus, key, timeout_s=timeout_s, read=lambda r: r.payload if r.ok else None)
        return found or b""

    async def _ask(self, key: str, payload: bytes, owner: str, wait_s: float) -> Answer:
        deadline = Deadline(self.patience_s + wait_s)
        while (left_s := deadline.left_s) > 0:
            answer = await first_answer(self.bus, key, payload, timeout_s=min(left_s, ATTEMPT_S), read=_answer_of)
            if isinstance(answer, Problem):
                raise answer.error()
            if isinstance(answer, Answer):
                return answer
            await asyncio.sleep(PAUSE_S)
        raise Unavailable(f"the {owner} does not answer")


def _answer_of(reply: Reply) -> Answer | Problem | None:
    return _decoded(Answer, reply) if reply.ok else _decoded(Problem, reply)


def _decoded(kind: type[M], reply: Reply) -> M | None:
    try:
        return decode(kind, reply.payload)
    except MalformedMessage:  # not a reply of this mesh: Zenoh reports "Timeout" in this way
        return None
