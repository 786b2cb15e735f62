"""The facts that the services read from each other, by their numbers, as far as a recording has them. Pure."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import NoReturn

from shift_schemas.lifecycle import is_ending
from shift_schemas.messages import Fact, Session

from shift_verify.difference import FactAtPlace, NotRecorded, differ, is_missing

NUMBER = {"config": "version", "decision": "n", "performance": "n", "policy": "version"}
"""The field that numbers the facts of a subject that other services read."""


@dataclass
class Inputs:
    """The facts that services read from each other, except observations, which are too many to keep."""

    session: Session
    complete: bool
    ending: Session | None = None
    numbered: dict[str, dict[int, Fact]] = field(default_factory=lambda: {subject: {} for subject in NUMBER})
    """The facts by subject (config, decision, performance, policy) and number."""
    claimed: dict[str, int] = field(default_factory=dict)
    """For decision and performance: the largest number that any service except the monitor says it has seen."""
    gaze: bool = False
    """Whether there is any gaze."""

    def add(self, facts: Iterable[Fact]) -> None:
        """Add facts of the recorder, the decider and the learner."""
        for fact in facts:
            if (name := NUMBER.get(fact.subject)) is not None:
                self.numbered[fact.subject][getattr(fact, name)] = fact
            if isinstance(fact, Session) and is_ending(fact.state):
                self.ending = fact
            for subject in ("decision", "performance"):
                self.claimed[subject] = max(self.claimed.get(subject, 0), getattr(fact.seen, subject))

    def last(self, subject: str) -> int:
        """Return the largest number of a subject, 0 if there is none."""
        return max(self.numbered[subject], default=0)

    def get(self, subject: str, n: int, by: FactAtPlace) -> Fact:
        """Return the input that ``by`` has seen.

        Raises
        ------
        Differs
            The recording is whole and does not have it.
        NotRecorded
            The recording is not whole, so the input may be elsewhere.
        """
        found = self.numbered[subject].get(n)
        if found is None:
            self._raise_absent(subject, n, by)
        return found

    def _raise_absent(self, subject: str, n: int, by: FactAtPlace) -> NoReturn:
        if not self.complete:
            raise NotRecorded(f"{by.fact.subject} {by.sequence} has seen {subject} {n}, which is not in the file yet")
        if n <= self.claimed.get(subject, 0):
            is_missing(subject, 0, by.place, f"number {n} of them has been seen by others")
        differ(by, f"seen.{subject}", getattr(by.fact.seen, subject), n - 1)
