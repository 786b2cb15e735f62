"""Parts of a worker for tests of one class alone: requests, facts, and a schedule that runs when it is told to."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from shift_runtime.reader import ReadFact
from shift_runtime.service.requests import PendingRequest
from shift_schemas.messages import Decide, Fact

from support.worker_rig import fixation


@dataclass
class Asker:
    """A request on the bus, and what it was answered."""

    key: str = "shift/v1/s1/rpc/decide"
    payload: bytes = b""
    replies: list[bytes] = field(default_factory=list)
    refusals: list[bytes] = field(default_factory=list)

    def reply(self, payload: bytes) -> None:
        self.replies.append(payload)

    def refuse(self, payload: bytes) -> None:
        self.refusals.append(payload)


def decide(command_id: str = "d1", task: str = "any", session: str = "s1") -> Decide:
    return Decide(command_id=command_id, session=session, task=task)


def pending(command_id: str = "d1", task: str = "any", *askers: Asker, session: str = "s1") -> PendingRequest:
    return PendingRequest(session, "decide", decide(command_id, task, session), list(askers))


def read(seq: int, fact: Fact | None = None, owner: str = "monitor") -> ReadFact:
    fact = fact if fact is not None else fixation(seq)
    return ReadFact(owner, seq, fact, fact.model_dump_json())


@dataclass
class Schedule:
    """Keeps what is put before a worker until :meth:`run`."""

    items: list[Callable[[], None]] = field(default_factory=list)

    def __call__(self, item: Callable[[], None]) -> None:
        self.items.append(item)

    def run(self) -> None:
        items, self.items = self.items, []
        for item in items:
            item()


@dataclass
class Positions:
    """A reader's cursors."""

    cursors: dict[tuple[str, str], int] = field(default_factory=dict)
