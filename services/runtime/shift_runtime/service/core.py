"""A service's core as the worker runs it: its fold, its state as text, and what it reads."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Generic, Protocol, TypeVar

from shift_schemas.core_protocol import Step
from shift_schemas.errors import ShiftError
from shift_schemas.messages import Fact
from shift_schemas.timestamps import Stamp

S = TypeVar("S")


class Recall(Protocol):
    """A search among the facts of one session that the service itself published."""

    def __call__(self, subject: str, **fields: str | int) -> list[Fact]:
        """Return the facts of ``subject`` whose fields have these values, oldest first."""


class CoreStep(Protocol[S]):
    """A core's fold."""

    def __call__(self, state: S | None, message: Any, now: Stamp, /, timed_out: bool = False) -> Step[S]:
        """Return the next state and the facts that follow from ``message``."""


@dataclass(frozen=True)
class Parts(Generic[S]):
    """Parts of a state that have rows of their own in the journal, because most commits do not change them.

    A part is written where it is another object than at the last commit, so a core never changes one in place.
    """

    of: Callable[[S], Mapping[str, Any]]
    """Returns the parts by name."""
    without: Callable[[S], S]
    """Returns the state without its parts."""
    dump: Callable[[Any], str]
    """Returns a part as text."""
    restore: Callable[[S, Mapping[str, str]], S]
    """Returns the state with its parts, which are given as texts by name."""


@dataclass(frozen=True)
class Core(Generic[S]):
    """A core and its inputs: the owners that it reads, and the subjects of each that it steps on."""

    name: str
    step: CoreStep[S]
    dump: Callable[[S], str]
    load: Callable[[str], S]
    reads: Mapping[str, frozenset[str]]
    prepare: Callable[[S | None, Any, Recall], Any] = lambda state, message, recall: message
    """Turns a request's message into what the core steps on, given the state and the facts recorded before."""
    held: Callable[[S], Any | None] = lambda state: None
    """Returns the event that makes the core publish what it holds back, or None if it holds nothing back."""
    refused: Callable[[S, Any, ShiftError], S] | None = None
    """Returns the state after a request that was refused, for a core that counts refusals."""
    parts: Parts[S] | None = None
    """The parts of the state that are kept apart, if there are any."""
    lookups: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """By subject of its own, the fields by which ``recall`` finds facts."""
