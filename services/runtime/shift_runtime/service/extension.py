"""The extension points of the worker: a sink for the facts of others, and a protocol for ends in two halves."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Any, Protocol

from shift_schemas.messages import Message

from shift_runtime.reader import ReadFact
from shift_runtime.service.requests import PendingRequest


class FactSink(Protocol):
    """The processing of the facts that a service reads."""

    def apply(self, read: ReadFact) -> None:
        """Process one fact, or let the reader deliver it again later."""


class EndProtocol(Protocol):
    """A command in two halves: the first half is committed at once, and the second half replies."""

    def takes(self, request: PendingRequest) -> bool:
        """Return whether this request is a first half."""

    def wait(self, request: PendingRequest) -> None:
        """Keep a request whose first half was carried out until the second half replies."""

    def after_commit(self) -> None:
        """Begin the second halves of what is committed now. It is called after every turn that was not undone."""


class NoEndProtocol:
    """The end protocol of a service whose commands all have one half."""

    def takes(self, request: PendingRequest) -> bool:
        """Return False."""
        return False

    def wait(self, request: PendingRequest) -> None:
        """Raise :class:`AssertionError`: no request is a first half."""
        raise AssertionError(f"{request.procedure} has one half")

    def after_commit(self) -> None:
        """Do nothing."""


async def _nothing() -> None:
    return


@dataclass(frozen=True)
class Extension:
    """The parts that one service adds to the worker."""

    sink: FactSink
    ends: EndProtocol
    prepare: Callable[[str, Message], Any]
    """Turns a session's request into what the core steps on; raises :class:`ShiftError` to refuse it."""
    start: Callable[[], Awaitable[None]] = _nothing
    stop: Callable[[], Awaitable[None]] = _nothing
