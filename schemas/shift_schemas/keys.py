"""Keys of the mesh. ``parse_key(build_key(k)) == k`` for every key, and nothing else parses. Pure.

==========================================  =====================================================================
``shift/v1/{session}/{subject}``            a fact, published by its owner as a notification
``shift/v1/{session}/in/{stream}``          a stream into a service
``shift/v1/{session}/rpc/{procedure}``      a command
``shift/v1/@service/{service}/{endpoint}``  an endpoint of a service itself: outbox, health, metrics, alive
``shift/v1/@replay/{session}``              the status of a replay, and the endpoint that controls it
==========================================  =====================================================================
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

from shift_schemas.errors import MalformedMessage, shorten
from shift_schemas.ids import is_id, not_an_id
from shift_schemas.registry import OWNER_OF, PROCEDURE_OWNER, SERVICES, STREAMS

ROOT = "shift/v1"

ENDPOINTS: tuple[str, ...] = ("outbox", "health", "metrics", "alive")
CACHED_KEYS = 1024
"""How many keys are cached with their texts. Each message needs one, and a session has about twenty."""


@dataclass(frozen=True)
class FactKey:
    """The key under which a fact of one session is published."""

    session: str
    subject: str


@dataclass(frozen=True)
class StreamKey:
    """The key of a stream into a service."""

    session: str
    stream: str


@dataclass(frozen=True)
class CommandKey:
    """The key under which a command is requested."""

    session: str
    procedure: str


@dataclass(frozen=True)
class ServiceKey:
    """The key of an endpoint of a service itself."""

    service: str
    endpoint: str


@dataclass(frozen=True)
class ReplayKey:
    """The key of a replay: its status is published there, and requests control it."""

    session: str


Key = FactKey | StreamKey | CommandKey | ServiceKey | ReplayKey

EVERY_REPLAY = f"{ROOT}/@replay/*"
"""Matches the key of every replay."""


@lru_cache(maxsize=CACHED_KEYS)
def build_key(key: Key) -> str:
    """Return the key's text. Raise :class:`MalformedMessage` for a session that is not an id or for an unknown name."""
    match key:
        case FactKey(session, subject):
            return f"{ROOT}/{_id(session)}/{_known(subject, OWNER_OF)}"
        case StreamKey(session, stream):
            return f"{ROOT}/{_id(session)}/in/{_known(stream, STREAMS)}"
        case CommandKey(session, procedure):
            return f"{ROOT}/{_id(session)}/rpc/{_known(procedure, PROCEDURE_OWNER)}"
        case ServiceKey(service, endpoint):
            return f"{ROOT}/@service/{_known(service, SERVICES)}/{_known(endpoint, ENDPOINTS)}"
        case ReplayKey(session):
            return f"{ROOT}/@replay/{_id(session)}"


@lru_cache(maxsize=CACHED_KEYS)
def parse_key(text: str) -> Key:
    """Return the key that ``text`` spells. Raise :class:`MalformedMessage` for anything else."""
    parts = text.split("/")
    if parts[:2] == ROOT.split("/"):
        match parts[2:]:
            case ["@service", service, endpoint]:
                return ServiceKey(_known(service, SERVICES), _known(endpoint, ENDPOINTS))
            case ["@replay", session]:
                return ReplayKey(_id(session))
            case [session, subject]:
                return FactKey(_id(session), _known(subject, OWNER_OF))
            case [session, "in", stream]:
                return StreamKey(_id(session), _known(stream, STREAMS))
            case [session, "rpc", procedure]:
                return CommandKey(_id(session), _known(procedure, PROCEDURE_OWNER))
    raise MalformedMessage(f"{shorten(text)!r} is not a key of this mesh")


def _id(text: str) -> str:
    if not is_id(text):
        raise MalformedMessage(not_an_id(text))
    return text


def _known(text: str, names: dict[str, str] | tuple[str, ...]) -> str:
    if text not in names:
        raise MalformedMessage(f"{shorten(text)!r} is not one of {', '.join(names)}")
    return text
