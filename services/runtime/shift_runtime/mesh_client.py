"""The mesh client: what every door uses to ask the services.

A command is sent again with the same id until its reply comes or its time is up: the id makes that
safe. No reply is a failure that names the service, never a success.
"""

from __future__ import annotations

import asyncio

from shift_schemas.codec import M, decode, encode
from shift_schemas.errors import MalformedMessage, Problem, Unavailable
from shift_schemas.keys import CommandKey, ServiceKey, StreamKey, build_key
from shift_schemas.messages import Answer, Command, GazeChunk, Health
from shift_schemas.registry import PROCEDURE_OWNER, STREAMS

from shift_runtime.bus.protocol import Bus, Reply, first_answer
from shift_runtime.claim import healths_of, one_health

ATTEMPT_S = 1.0
"""A request that is lost with a dying router hangs for its whole time; so each attempt is short."""
PAUSE_S = 0.05


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
            How long the service itself may wait before it answers (``decider.wait_s``).

        Raises
        ------
        ShiftError
            The service's refusal, or :class:`Unavailable` when it did not answer.
        """
        key = build_key(CommandKey(command.session, command.procedure))
        return await self._ask(key, encode(command), PROCEDURE_OWNER[command.procedure], wait_s)

    async def gaze(self, session: str, chunk: GazeChunk) -> Answer:
        """Hand a chunk to the monitor; answered once it is committed."""
        return await self._ask(build_key(StreamKey(session, "gaze")), encode(chunk), STREAMS["gaze"], 0.0)

    async def health(self, service: str, timeout_s: float = 1.0) -> Health | None:
        """What the service's worker says of itself; none when it does not answer."""
        replies = await self.bus.get(build_key(ServiceKey(service, "health")), timeout_s=timeout_s)
        return one_health(service, list(healths_of(replies)))

    async def metrics(self, service: str, timeout_s: float = 1.0) -> bytes:
        """The service's metrics; empty when it does not answer."""
        key = build_key(ServiceKey(service, "metrics"))
        found = await first_answer(self.bus, key, timeout_s=timeout_s, read=lambda r: r.payload if r.ok else None)
        return found or b""

    async def _ask(self, key: str, payload: bytes, owner: str, wait_s: float) -> Answer:
        loop = asyncio.get_running_loop()
        deadline = loop.time() + self.patience_s + wait_s
        while True:
            left = deadline - loop.time()
            if left <= 0:
                raise Unavailable(f"the {owner} does not answer")
            answer = await first_answer(self.bus, key, payload, timeout_s=min(left, ATTEMPT_S), read=_answer_of)
            if isinstance(answer, Problem):
                raise answer.error()
            if isinstance(answer, Answer):
                return answer
            await asyncio.sleep(PAUSE_S)


def _answer_of(reply: Reply) -> Answer | Problem | None:
    return _decoded(Answer, reply) if reply.ok else _decoded(Problem, reply)


def _decoded(kind: type[M], reply: Reply) -> M | None:
    try:
        return decode(kind, reply.payload)
    except MalformedMessage:  # not one of ours: Zenoh says "Timeout" this way
        return None
