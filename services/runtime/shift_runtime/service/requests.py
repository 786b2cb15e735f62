"""Requests: commands and stream chunks are decoded, joined with equal ones, and answered once per command id."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Protocol

from shift_schemas.codec import decode, encode
from shift_schemas.conflicts import repeat_conflict
from shift_schemas.errors import MalformedMessage, Problem, ShiftError
from shift_schemas.keys import ROOT, CommandKey, StreamKey, parse_key
from shift_schemas.messages import Command, Message, StreamItem
from shift_schemas.registry import COMMANDS, STREAM_ITEMS

from shift_runtime.bus.protocol import Bus, Incoming, Request
from shift_runtime.journal import AnswerKey, StoredAnswer, same_content
from shift_runtime.metrics import Metrics

STREAM_LIMIT = 5_000
"""How many chunks may wait; further ones are dropped and counted."""


@dataclass(eq=False)
class PendingRequest:
    """A command or a chunk that waits for its reply. Equal requests that arrive meanwhile wait for the same reply."""

    session: str
    procedure: str
    """The command's procedure, or the stream's name."""
    message: Message
    requests: list[Request]
    deadline: float | None = None
    """When the service gives up waiting for missing inputs, on the loop's clock."""
    timed_out: bool = False
    """Whether it has given up."""
    checked: bool = False
    """Whether the owners were asked again before something was called unknown."""

    @property
    def key(self) -> AnswerKey | None:
        """The key of its stored result; None for a chunk, whose own number tells repeats."""
        if isinstance(self.message, Command):
            return (self.session, self.procedure, self.message.command_id)
        return None

    def reply(self, payload: bytes) -> None:
        """Answer everybody who waits with a result."""
        for request in self.requests:
            request.reply(payload)

    def refuse(self, error: ShiftError) -> None:
        """Answer everybody who waits with an error."""
        payload = encode(Problem.of(error))
        for request in self.requests:
            request.refuse(payload)
        self.requests.clear()


class StoredAnswers(Protocol):
    """The results of earlier commands, as the journal keeps them."""

    def answer(self, key: AnswerKey) -> StoredAnswer | None:
        """Return the stored result of a command, if it was carried out."""


class Requests:
    """Receives a service's requests and hands each one that is valid and not waiting already to ``deliver``.

    Parameters
    ----------
    join
        Adds a command to an equal one that is parked; returns whether there was one.
    """

    def __init__(
        self,
        service: str,
        bus: Bus,
        answers: StoredAnswers,
        metrics: Metrics,
        join: Callable[[PendingRequest], bool],
        deliver: Callable[[PendingRequest], None],
    ) -> None:
        self._service = service
        self._bus = bus
        self._answers = answers
        self._metrics = metrics
        self._join = join
        self._deliver = deliver

    def declare(self) -> None:
        """Receive the commands and the streams that the service owns."""
        for procedure, command in COMMANDS.items():
            if command.owner == self._service:
                self._bus.serve(f"{ROOT}/*/rpc/{procedure}", self._on_command)
        for stream, kind in STREAM_ITEMS.items():
            if kind.owner == self._service:
                key = f"{ROOT}/*/in/{stream}"
                self._bus.serve(key, partial(self._on_stream_request, kind), limit=STREAM_LIMIT)
                self._bus.subscribe(key, partial(self._on_stream, kind), limit=STREAM_LIMIT)

    def earlier_result(self, request: PendingRequest, uncommitted: Mapping[AnswerKey, StoredAnswer]) -> str | None:
        """Return the result, as JSON, of an equal command that was carried out before, or None.

        Raises
        ------
        Conflict
            The command's id was used before, with another content.
        """
        message, key = request.message, request.key
        if key is None or not isinstance(message, Command):
            return None
        stored = uncommitted.get(key) or self._answers.answer(key)
        if stored is None:
            return None
        if not same_content(stored.content, message.content()):
            raise repeat_conflict(message, stored.content)
        return stored.result

    def _on_command(self, request: Request) -> None:
        try:
            key = parse_key(request.key)
            if not isinstance(key, CommandKey):
                raise MalformedMessage(f"{request.key} is not the key of a command")
            command = decode(COMMANDS[key.procedure], request.payload)
            if command.session != key.session:
                raise MalformedMessage(f"a command for session {command.session} under session {key.session}")
        except MalformedMessage as e:
            self._refuse_malformed(request, e)
            return
        pending = PendingRequest(key.session, key.procedure, command, [request])
        if not self._join(pending):
            self._deliver(pending)

    def _on_stream_request(self, kind: type[StreamItem], request: Request) -> None:
        try:
            pending = _chunk(kind, request.key, request.payload)
        except MalformedMessage as e:
            self._refuse_malformed(request, e)
            return
        pending.requests.append(request)
        self._deliver(pending)

    def _on_stream(self, kind: type[StreamItem], incoming: Incoming) -> None:
        try:
            pending = _chunk(kind, incoming.key, incoming.payload)
        except MalformedMessage:
            self._metrics.dropped("malformed")
            return
        self._deliver(pending)

    def _refuse_malformed(self, request: Request, error: MalformedMessage) -> None:
        self._metrics.dropped("malformed")
        request.refuse(encode(Problem.of(error)))


def _chunk(kind: type[StreamItem], text: str, payload: bytes) -> PendingRequest:
    key = parse_key(text)
    if not isinstance(key, StreamKey):
        raise MalformedMessage(f"{text} is not the key of a stream")
    return PendingRequest(key.session, key.stream, decode(kind, payload), [])
