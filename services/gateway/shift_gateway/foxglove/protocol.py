"""The messages of the Foxglove WebSocket protocol, as far as a server without publishing clients needs them. Pure.

Source: the protocol's specification (github.com/foxglove/ws-protocol) and, for playback control, the documentation of
the crate ``foxglove`` 0.25 (``protocol::common``). Numbers in binary messages are little-endian. No library serves the
protocol inside another server: the Python SDK opens a port of its own.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

from shift_schemas.errors import MalformedMessage, shorten
from shift_schemas.timestamps import NS

SUBPROTOCOLS = ("foxglove.sdk.v1", "foxglove.websocket.v1")
"""Both names of the protocol; a client offers at least one of them."""

MESSAGE_DATA, TIME, PLAYBACK_STATE = 0x01, 0x02, 0x05
PLAYBACK_CONTROL = 0x03
"""The only binary message that this server accepts."""
MOST_SUBSCRIPTIONS = 10_000
"""Chosen: more than all topics of all sessions that a client looks at; it bounds the memory of a connection."""
_DATA = struct.Struct("<BIQ")
_TIME = struct.Struct("<BQ")
_STATE = struct.Struct("<BBQfBI")
_CONTROL = struct.Struct("<BBfBQI")


class Level(IntEnum):
    """How serious a status message is."""

    INFO, WARNING, ERROR = range(3)


class PlaybackStatus(IntEnum):
    """What the server's playback is doing."""

    PLAYING, PAUSED, BUFFERING, ENDED = range(4)


@dataclass(frozen=True)
class Channel:
    """A topic that a client can subscribe to. The messages are JSON, with a JSON schema."""

    id: int
    topic: str
    schema_name: str
    schema: str

    def as_json(self) -> dict[str, Any]:
        """Return the channel as it is advertised."""
        return {
            "id": self.id, "topic": self.topic, "encoding": "json", "schemaName": self.schema_name,
            "schema": self.schema, "schemaEncoding": "jsonschema",
        }  # fmt: skip


# --- messages of the server ---


def server_info(name: str, session_id: str, extent: tuple[int, int] | None = None) -> str:
    """Return the first message. ``extent`` is the first and last time of a recording, ns, for playback control."""
    info: dict[str, Any] = {
        "op": "serverInfo", "name": name, "capabilities": ["time"], "supportedEncodings": ["json"],
        "metadata": {}, "sessionId": session_id,
    }  # fmt: skip
    if extent is not None:
        info["capabilities"].append("playbackControl")
        for field, ns in zip(("dataStartTime", "dataEndTime"), extent, strict=True):
            info[field] = {"sec": ns // NS, "nsec": ns % NS}
    return json.dumps(info)


def advertise(channels: Iterable[Channel]) -> str:
    """Return the message that offers channels."""
    return json.dumps({"op": "advertise", "channels": [channel.as_json() for channel in channels]})


def unadvertise(ids: Sequence[int]) -> str:
    """Return the message that withdraws channels."""
    return json.dumps({"op": "unadvertise", "channelIds": list(ids)})


def status(level: Level, sentence: str) -> str:
    """Return a message for the user of the client."""
    return json.dumps({"op": "status", "level": int(level), "message": sentence})


def message_data(subscription: int, ns: int, payload: bytes) -> bytes:
    """Return a message of a channel; ``ns`` is its time since the epoch."""
    return _DATA.pack(MESSAGE_DATA, subscription, ns) + payload


def time_of(ns: int) -> bytes:
    """Return the time of the server, ns since the epoch."""
    return _TIME.pack(TIME, ns)


def playback_state(what: PlaybackStatus, ns: int, speed: float, did_seek: bool, request_id: str = "") -> bytes:
    """Return the state of playback; ``request_id`` is that of the request that it answers."""
    name = request_id.encode()
    return _STATE.pack(PLAYBACK_STATE, what, ns, speed, did_seek, len(name)) + name


# --- messages of a client ---


@dataclass(frozen=True)
class Subscribe:
    """Subscriptions: each id with its channel."""

    channels: dict[int, int]


@dataclass(frozen=True)
class Unsubscribe:
    """The ids of subscriptions that end."""

    subscriptions: tuple[int, ...]


@dataclass(frozen=True)
class ControlPlayback:
    """A request to play or pause at a speed, from another time on if ``seek_ns`` is given."""

    play: bool
    speed: float
    seek_ns: int | None
    request_id: str


Request = Subscribe | Unsubscribe | ControlPlayback


def read_request(raw: str | bytes) -> Request:
    """Return a client's message. Raise :class:`MalformedMessage` for anything that this server does not do."""
    if isinstance(raw, bytes):
        return _control(raw)
    try:
        data = json.loads(raw)
    except (ValueError, RecursionError) as e:
        raise MalformedMessage("the message is not JSON") from e
    if not isinstance(data, dict):
        raise MalformedMessage("the message is not a JSON object")
    match data.get("op"):
        case "subscribe":
            return Subscribe(dict(_pairs(data.get("subscriptions"))))
        case "unsubscribe":
            return Unsubscribe(tuple(_numbers(data.get("subscriptionIds"))))
    raise MalformedMessage(f"this server only sends; it does not know the operation {shorten(data.get('op'))!r}")


def _pairs(given: Any) -> Iterable[tuple[int, int]]:
    for each in _list(given, "subscriptions"):
        if not isinstance(each, dict) or not _is_number(each.get("id")) or not _is_number(each.get("channelId")):
            raise MalformedMessage('a subscription is {"id": NUMBER, "channelId": NUMBER}')
        yield each["id"], each["channelId"]


def _numbers(given: Any) -> Iterable[int]:
    for each in _list(given, "subscriptionIds"):
        if not _is_number(each):
            raise MalformedMessage(f"subscriptionIds has {shorten(each)!r}, which is not a number")
        yield each


def _list(given: Any, name: str) -> list[Any]:
    if not isinstance(given, list) or len(given) > MOST_SUBSCRIPTIONS:
        raise MalformedMessage(f"{name} must be a list of at most {MOST_SUBSCRIPTIONS} entries")
    return given


def _is_number(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value < 2**32


def _control(raw: bytes) -> ControlPlayback:
    if raw[:1] != bytes([PLAYBACK_CONTROL]) or len(raw) < _CONTROL.size:
        raise MalformedMessage("this server accepts no binary message but playback control")
    _, command, speed, has_seek, seek_ns, length = _CONTROL.unpack_from(raw)
    name = raw[_CONTROL.size :]
    if command > 1 or not 0 < speed <= 1000 or length != len(name):
        raise MalformedMessage("the playback control is not valid: the command is 0 or 1, the speed above 0 to 1000")
    try:
        return ControlPlayback(command == 0, speed, seek_ns if has_seek else None, name.decode())
    except UnicodeDecodeError as e:
        raise MalformedMessage("the request id of the playback control is not UTF-8") from e
