"""The WebSocket ``/foxglove``: running sessions, one of them (``?session=``), or a recording (``?recording=``)."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Protocol

from fastapi import FastAPI, WebSocket
from shift_schemas.errors import MalformedMessage, ShiftError, UnknownThing, check_id, shorten

from shift_gateway.foxglove.connection import Connection
from shift_gateway.foxglove.live import LiveSessions
from shift_gateway.foxglove.playback import Extent, Playback
from shift_gateway.foxglove.protocol import SUBPROTOCOLS, Level, Request, read_request, server_info, status
from shift_gateway.gateway import Gateway
from shift_gateway.recordings import recording_path

NO_SUBPROTOCOL, REFUSED = 1002, 1008
"""Closing codes of RFC 6455: a protocol error, and a policy violation."""
MOST_BYTES = 256 * 1024


class Feed(Protocol):
    """What sends messages to a client."""

    async def run(self) -> None:
        """Send until it is cancelled."""

    def apply(self, request: Request) -> None:
        """Carry out a request of the client."""


def add_foxglove(app: FastAPI, gateway: Gateway) -> None:
    """Add the path."""

    @app.websocket("/foxglove")
    async def foxglove(socket: WebSocket) -> None:
        subprotocol = _common(socket.scope.get("subprotocols") or ())
        await socket.accept(subprotocol)
        if subprotocol is None:
            await socket.close(NO_SUBPROTOCOL, f"offer the subprotocol {' or '.join(SUBPROTOCOLS)}")
            return
        connection = Connection(socket, partial(gateway.metrics.dropped, "overload"))
        sending = asyncio.create_task(connection.send_waiting())
        try:
            feed = await _feed(gateway, connection, dict(socket.query_params))
        except ShiftError as e:
            connection.send(server_info("SHIFT mesh", "refused"))
            connection.send(status(Level.ERROR, e.detail))
            await asyncio.sleep(0.1)
            sending.cancel()
            await socket.close(REFUSED, e.detail[:100])
            return
        running = asyncio.create_task(feed.run())
        try:
            await _receive(socket, connection, feed)
        finally:
            running.cancel()
            sending.cancel()


def _common(offered: Sequence[str]) -> str | None:
    return next((name for name in SUBPROTOCOLS if name in offered), None)


async def _feed(gateway: Gateway, connection: Connection, query: dict[str, str]) -> Feed:
    """Return what the address asks for, after the first message. Raises :class:`ShiftError`."""
    if unknown := [name for name in query if name not in ("session", "recording")]:
        raise MalformedMessage(f"{shorten(unknown[0])!r} is not known here; write ?session=NAME or ?recording=FILE")
    if "recording" in query:
        return await _playback(gateway, connection, query["recording"])
    only = query.get("session")
    if only is not None:
        await gateway.read_model.view(check_id("session", only))
    connection.send(server_info(f"SHIFT mesh: {only or 'running sessions'}", f"live-{only or 'all'}"))
    return LiveSessions(connection, gateway.read_model, only, lambda: gateway.api.clock.now().ns)


async def _playback(gateway: Gateway, connection: Connection, name: str) -> Feed:
    path: Path | None = recording_path(gateway.recordings, name)
    if path is None or path.suffix != ".mcap":
        raise UnknownThing(f"there is no recording {name[:80]}")
    extent = await asyncio.to_thread(Extent, path)
    connection.send(server_info(f"SHIFT mesh: {name}", f"recording-{name}", (extent.first, extent.last)))
    return Playback(connection, path, extent)


async def _receive(socket: WebSocket, connection: Connection, feed: Feed) -> None:
    """Carry out the client's requests until it leaves. A message that is not valid is answered with a warning."""
    while True:
        arrived = await socket.receive()
        if arrived["type"] == "websocket.disconnect":
            return
        raw = arrived.get("text") or arrived.get("bytes") or ""
        try:
            if len(raw) > MOST_BYTES:
                raise MalformedMessage(f"the message has {len(raw)} bytes; at most {MOST_BYTES} are accepted")
            feed.apply(read_request(raw))
        except MalformedMessage as e:
            connection.send(status(Level.WARNING, e.detail))
