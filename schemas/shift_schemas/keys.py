"""Keys of the mesh. ``parse_key(build_key(k)) == k`` for every key, and nothing else parses.

=================================  =====================================================
``shift/v1/{session}/{subject}``          a fact, published as a hint by its owner
``shift/v1/{session}/in/{stream}``        a stream into a service
``shift/v1/{session}/rpc/{procedure}``    a command
``shift/v1/@service/{service}/{door}``    a service's own doors: outbox, health, metrics, alive
=================================  =====================================================
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

from shift_schemas.errors import MalformedMessage, shorten
from shift_schemas.ids import is_id, not_an_id

ROOT = "shift/v1"

OWNERS: dict[str, tuple[str, ...]] = {
    "recorder": ("session", "config", "marker"),
    "monitor": ("gaze", "fixation", "observation"),
    "decider": ("estimate", "decision", "override"),
    "learner": ("performance", "transition", "policy"),
}
"""Who puts out which facts: each fact has exactly one owner (DESIGN.md, "The loop")."""

SUBJECTS: tuple[str, ...] = (
    "session", "config", "gaze", "fixation", "observation", "estimate", "decision", "override",
    "performance", "transition", "policy", "marker",
)  # fmt: skip
"""Subjects in INTERFACE.md's order; they are the recording's topics."""

READS: dict[str, dict[str, frozenset[str]]] = {
    "recorder": dict.fromkeys(OWNERS, frozenset()),
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
"""Whose journals each service reads, and which of their subjects its core steps on (the recorder: it files all)."""

OWNER_OF: dict[str, str] = {subject: owner for owner, subjects in OWNERS.items() for subject in subjects}

PROCEDURES: dict[str, tuple[str, ...]] = {
    "recorder": ("start_session", "end_session", "configure", "mark"),
    "monitor": (),
    "decider": ("decide", "override"),
    "learner": ("report_performance",),
}
PROCEDURE_OWNER: dict[str, str] = {p: owner for owner, ps in PROCEDURES.items() for p in ps}
STREAMS: dict[str, str] = {"gaze": "monitor"}
SERVICES: tuple[str, ...] = (
    "recorder",
    "monitor",
    "decider",
    "learner",
    "gateway",
    "ros2_bridge",
    "simulator",
)
ENDPOINTS: tuple[str, ...] = ("outbox", "health", "metrics", "alive")
KEYS = 1024
"""So many keys are remembered with their texts: each message has one, and a session has some twenty."""


@dataclass(frozen=True)
class FactKey:
    """Where a fact of one session is published."""

    session: str
    subject: str


@dataclass(frozen=True)
class StreamKey:
    """Where a stream flows into a service."""

    session: str
    stream: str


@dataclass(frozen=True)
class CommandKey:
    """Where a command is asked for."""

    session: str
    procedure: str


@dataclass(frozen=True)
class ServiceKey:
    """One of a service's own doors."""

    service: str
    endpoint: str


Key = FactKey | StreamKey | CommandKey | ServiceKey


@lru_cache(maxsize=KEYS)
def build_key(key: Key) -> str:
    """The key's text. Raises :class:`MalformedMessage` for a session that is no id or an unknown word."""
    match key:
        case FactKey(session, subject):
            return f"{ROOT}/{_id(session)}/{_word(subject, OWNER_OF)}"
        case StreamKey(session, stream):
            return f"{ROOT}/{_id(session)}/in/{_word(stream, STREAMS)}"
        case CommandKey(session, procedure):
            return f"{ROOT}/{_id(session)}/rpc/{_word(procedure, PROCEDURE_OWNER)}"
        case ServiceKey(service, endpoint):
            return f"{ROOT}/@service/{_word(service, SERVICES)}/{_word(endpoint, ENDPOINTS)}"


@lru_cache(maxsize=KEYS)
def parse_key(text: str) -> Key:
    """The key that ``text`` spells. Raises :class:`MalformedMessage` for anything else."""
    parts = text.split("/")
    if parts[:2] == ROOT.split("/"):
        match parts[2:]:
            case ["@service", service, endpoint]:
                return ServiceKey(_word(service, SERVICES), _word(endpoint, ENDPOINTS))
            case [session, subject]:
                return FactKey(_id(session), _word(subject, OWNER_OF))
            case [session, "in", stream]:
                return StreamKey(_id(session), _word(stream, STREAMS))
            case [session, "rpc", procedure]:
                return CommandKey(_id(session), _word(procedure, PROCEDURE_OWNER))
    raise MalformedMessage(f"{shorten(text)!r} is no key of this mesh")


def _id(text: str) -> str:
    if not is_id(text):
        raise MalformedMessage(not_an_id(text))
    return text


def _word(text: str, words: dict[str, str] | tuple[str, ...]) -> str:
    if text not in words:
        raise MalformedMessage(f"{shorten(text)!r} is none of {', '.join(words)}")
    return text
