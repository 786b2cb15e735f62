"""The tables of owners, subjects, procedures and streams, derived from the messages' own declarations. Pure.

Only ``READS`` is declared here: it belongs to the services and not to a message.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TypeVar

import shift_schemas.messages  # noqa: F401 - importing the package declares every message
from shift_schemas.messages.base import Command, Fact, StreamItem

Declared = TypeVar("Declared", bound=type[Fact] | type[Command] | type[StreamItem])

READS: dict[str, dict[str, frozenset[str]]] = {
    "recorder": dict.fromkeys(("recorder", "monitor", "decider", "learner"), frozenset()),
    "monitor": {
        "recorder": frozenset({"session", "config"}),
        "decider": frozenset({"decision"}),
        "learner": frozenset({"performance"}),
    },
    "decider": {
        "recorder": frozenset({"session", "config"}),
        "monitor": frozenset({"observation"}),
        "learner": frozenset({"policy"}),
    },
    "learner": {"recorder": frozenset({"session", "config"}), "decider": frozenset({"decision"})},
}
"""Whose journals each owner reads, and on which of their subjects its core steps. The recorder records all of them.

The owners stand in the order in which every other table has them.
"""


def by_owner(declared: Iterable[Declared]) -> tuple[Declared, ...]:
    """Return the messages in the order of their owners; messages of one owner stay in the order of their declaration.

    Raise :class:`KeyError` for a message of an owner that ``READS`` does not have.
    """
    rank = {owner: place for place, owner in enumerate(READS)}
    return tuple(sorted(declared, key=lambda message: rank[message.owner]))


def by_name(declared: Iterable[Declared], field: str) -> dict[str, Declared]:
    """Return the messages by the name that they declare as ``field``. Raise :class:`ValueError` if two share one."""
    found: dict[str, Declared] = {}
    for message in declared:
        name = getattr(message, field)
        if (other := found.setdefault(name, message)) is not message:
            raise ValueError(f"{message.__name__} and {other.__name__} have the same {field} {name!r}; rename one")
    return found


def fact_types() -> dict[str, type[Fact]]:
    """Return every declared fact by its subject, in the order of the recording's topics."""
    return by_name(sorted(by_owner(Fact.__subclasses__()), key=lambda fact: fact.listed_last), "subject")


def command_types() -> dict[str, type[Command]]:
    """Return every declared command by its procedure. A subclass of a command is a service's own variant of it."""
    return by_name(by_owner(Command.__subclasses__()), "procedure")


def stream_types() -> dict[str, type[StreamItem]]:
    """Return the type of every declared stream's items by the stream's name."""
    return by_name(by_owner(StreamItem.__subclasses__()), "stream")


FACTS = fact_types()
"""Every fact by its subject, in the recording's order of topics."""
COMMANDS = command_types()
"""Every command by its procedure."""
STREAM_ITEMS = stream_types()
"""The items of every stream by the stream's name."""

SUBJECTS: tuple[str, ...] = tuple(FACTS)
"""The subjects in the order of docs/interface.md; they are the topics of a recording."""
OWNER_OF: dict[str, str] = {subject: fact.owner for subject, fact in FACTS.items()}
"""The owner of each subject: each fact has exactly one (docs/design.md)."""
OWNERS: dict[str, tuple[str, ...]] = {owner: tuple(s for s in FACTS if OWNER_OF[s] == owner) for owner in READS}
"""The subjects that each owner publishes."""
PROCEDURE_OWNER: dict[str, str] = {procedure: command.owner for procedure, command in COMMANDS.items()}
"""The owner that carries out each procedure."""
PROCEDURES: dict[str, tuple[str, ...]] = {
    owner: tuple(p for p in COMMANDS if PROCEDURE_OWNER[p] == owner) for owner in READS
}
"""The procedures that each owner carries out."""
STREAMS: dict[str, str] = {stream: item.owner for stream, item in STREAM_ITEMS.items()}
"""The owner that receives each stream."""
SERVICES: tuple[str, ...] = (*READS, "gateway", "ros2_bridge", "simulator")
"""Every service that has endpoints of its own: the owners, and those that only ask them."""
