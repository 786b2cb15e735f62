"""The transaction: the changes of a service are committed as a whole or undone as a whole."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

import structlog
from shift_schemas.codec import decode
from shift_schemas.core_protocol import Step
from shift_schemas.errors import ShiftError, Unavailable
from shift_schemas.messages import Command, Fact, OutboxRow
from shift_schemas.registry import FACTS

from shift_runtime.journal import Batch, Journal, StoredAnswer
from shift_runtime.metrics import Metrics
from shift_runtime.reader import ReadFact
from shift_runtime.service.disk_alarm import DiskAlarm
from shift_runtime.service.progress import Progress
from shift_runtime.service.requests import PendingRequest
from shift_runtime.service.states import SessionStates

S = TypeVar("S")
log = structlog.get_logger()

COMMIT_WITHIN_S = 0.25
"""How long input without visible effect may wait for a commit that something else needs; chosen: little has to be read
again after a crash."""


@dataclass(frozen=True)
class PendingReply:
    """A reply that is sent after the commit: its result as JSON, and the owner's sequence that includes its effects."""

    request: PendingRequest
    result: str
    seq: int
    repeat: bool = False


@dataclass
class Transaction:
    """The changes since the last commit, and the replies that follow it."""

    batch: Batch = field(default_factory=Batch)
    before: dict[str, Any] = field(default_factory=dict)
    """By session, the state that :meth:`Transactions.commit` restores where the disk refuses."""
    facts: list[tuple[OutboxRow, Fact]] = field(default_factory=list)
    heads: dict[str, int] = field(default_factory=dict)
    """By session, the number of its last fact in this transaction."""
    replies: list[PendingReply] = field(default_factory=list)
    refusals: list[tuple[PendingRequest, ShiftError]] = field(default_factory=list)

    @property
    def must_commit(self) -> bool:
        """Whether a change is visible outside. Cursors alone need no commit: reading facts again has no effect."""
        batch = self.batch
        return bool(batch.rows or batch.answers or batch.closed) or any(not reply.repeat for reply in self.replies)

    def refuse(self, error: Unavailable) -> None:
        """Refuse every request: those whose results were lost with ``error``, the others with their own errors."""
        for reply in self.replies:
            reply.request.refuse(error)
        for request, refusal in self.refusals:
            request.refuse(refusal)


class Transactions(Generic[S]):
    """The open transaction of a service, and its commit.

    Parameters
    ----------
    schedule
        Runs a function in the worker's turn; a commit follows.
    """

    def __init__(
        self,
        journal: Journal,
        states: SessionStates[S],
        progress: Progress,
        alarm: DiskAlarm,
        metrics: Metrics,
        schedule: Callable[[Callable[[], None]], None],
    ) -> None:
        self._journal = journal
        self._states = states
        self._progress = progress
        self._alarm = alarm
        self._metrics = metrics
        self._schedule = schedule
        self._forced = False
        self._timing = False
        self.open = Transaction()

    # --- changes ---

    def apply_step(self, session: str, step: Step[S]) -> None:
        """Add the next state of a session and the facts to publish."""
        transaction = self.open
        transaction.before.setdefault(session, self._states.loaded(session))
        self._states.put(session, step.state)
        transaction.batch.states[session] = ""
        head = self.head(session)
        for seq, fact in enumerate(step.facts, start=head + 1):
            row = OutboxRow(session=session, seq=seq, subject=fact.subject, payload=fact.model_dump_json())
            transaction.batch.rows.append(row)
            transaction.facts.append((row, fact))
        transaction.heads[session] = head + len(step.facts)

    def mark_read(self, read: ReadFact) -> None:
        """Note that a fact of another service was processed."""
        self._progress.mark(read)
        self.open.batch.cursors[read.fact.session, read.owner] = read.seq

    def close_session(self, session: str) -> None:
        """Close a session that has ended: nothing more of it is read."""
        self.open.batch.closed.add(session)

    def store_answer(self, request: PendingRequest, step: Step[S]) -> None:
        """Store a command's result, which a repeat gets as well, and reply with it after the commit."""
        if isinstance(step.result, Fact):
            row = next(row for row, fact in self.open.facts if fact is step.result)
            result, seq = row.payload, row.seq
        else:
            result, seq = json.dumps(step.result), 0
        if request.key is not None and isinstance(request.message, Command):
            self.open.batch.answers[request.key] = StoredAnswer(request.message.content(), result, seq)
        self.reply(request, result, step.repeat)

    def reply(self, request: PendingRequest, result: str, repeat: bool) -> None:
        """Reply with a result after the commit."""
        self.open.replies.append(PendingReply(request, result, self.head(request.session), repeat))

    def refuse(self, request: PendingRequest, error: ShiftError) -> None:
        """Reply with an error after the commit."""
        self.open.refusals.append((request, error))

    # --- reading, committed or not ---

    def head(self, session: str) -> int:
        """Return the number of the session's last fact, committed or not."""
        return self.open.heads.get(session) or self._journal.heads.get(session, 0)

    def recall(self, session: str, subject: str, **fields: str | int) -> list[Fact]:
        """Return the session's own facts of ``subject`` whose fields have these values, oldest first."""
        kept = [decode(FACTS[subject], text) for text in self._journal.recorded(session, subject, fields)]
        uncommitted = [
            fact
            for row, fact in self.open.facts
            if (row.session, row.subject) == (session, subject)
            and all(getattr(fact, name) == value for name, value in fields.items())
        ]
        return [*kept, *uncommitted]

    # --- the commit ---

    def commit(self) -> Transaction | None:
        """Commit the changes if they are visible; return the transaction to reply to, or None if the disk refused.

        Input without visible effect is committed with the next visible change, or within :data:`COMMIT_WITHIN_S`. If
        the disk refuses, the whole transaction is undone and every request in it is refused.
        """
        done = self.open
        if not done.must_commit and not (self._forced and done.batch.states):
            self._defer(done)
            return done
        self.open, self._forced = Transaction(), False
        for session in done.batch.states:
            done.batch.states[session] = self._states.dump(session)
            for name, text in self._states.changed_parts(session).items():
                done.batch.parts[session, name] = text
        try:
            with self._metrics.commit_seconds.time():
                self._journal.commit(done.batch)
        except Unavailable as e:
            self._undo(done, e)
            return None
        self._alarm.clear_alarm()
        for session in done.batch.states:
            self._states.committed(session)
        return done

    def force_commit(self) -> None:
        """Let the next :meth:`commit` include what has no visible effect."""
        self._timing, self._forced = False, True

    def _defer(self, done: Transaction) -> None:
        self.open = Transaction(done.batch, done.before)
        if done.batch.states and not self._timing:
            self._timing = True
            asyncio.get_running_loop().call_later(COMMIT_WITHIN_S, self._schedule, self.force_commit)

    def _undo(self, undone: Transaction, error: Unavailable) -> None:
        self._alarm.raise_alarm(error)
        self._metrics.commit_failed()
        log.error("commit failed", error=error.detail)
        for session, state in undone.before.items():
            self._states.restore(session, state)
        self._progress.rewind(undone.batch.cursors)
        undone.refuse(error)
