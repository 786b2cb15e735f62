"""How far a service has processed the facts of each owner, and how to read some of them again."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Protocol

from shift_runtime.journal import Journal
from shift_runtime.reader import ReadFact

Input = tuple[str, str]
"""A session and an owner."""


class Cursors(Protocol):
    """A reader's positions: the last fact that it delivered of each input."""

    @property
    def cursors(self) -> dict[Input, int]:
        """The last sequence number by session and owner; the reader delivers the next one."""


class Progress:
    """The last fact of each input that was processed. A fact that was delivered may still wait to be processed."""

    def __init__(self, reader: Cursors, journal: Journal) -> None:
        self._reader = reader
        self._journal = journal
        self.processed: dict[Input, int] = dict(reader.cursors)

    def is_next(self, read: ReadFact) -> bool:
        """Return whether this fact follows the last one that was processed.

        It does not after :meth:`rewind`: the reader then delivers it again in its order.
        """
        return read.seq == self.processed.get((read.fact.session, read.owner), 0) + 1

    def mark(self, read: ReadFact) -> None:
        """Note that this fact was processed."""
        self.processed[read.fact.session, read.owner] = read.seq

    def put_back(self, read: ReadFact) -> None:
        """Let the reader deliver this fact again later."""
        self._reader.cursors[read.fact.session, read.owner] = read.seq - 1

    def rewind(self, inputs: Iterable[Input]) -> None:
        """Go back to what is committed of these inputs, so that the rest is delivered again."""
        committed = self._journal.cursors()
        for key in inputs:
            self.restart(*key, after=committed.get(key, 0))

    def restart(self, session: str, owner: str, after: int = 0) -> None:
        """Let the reader deliver all facts after number ``after`` again."""
        self._reader.cursors[session, owner] = self.processed[session, owner] = after
