"""One connected client: what it subscribed to, and what waits to be sent."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Iterable

from starlette.websockets import WebSocket, WebSocketDisconnect

from shift_gateway.foxglove.protocol import Channel, Subscribe, Unsubscribe, advertise, message_data, unadvertise

WAITING = 5_000
"""How many messages may wait for a slow client; above that the oldest ones are dropped and counted."""


class Connection:
    """A client, its subscriptions and its queue.

    Parameters
    ----------
    dropped
        Is called for each message that is dropped because the client is too slow.
    """

    def __init__(self, socket: WebSocket, dropped: Callable[[], None]) -> None:
        self.socket = socket
        self.channels: dict[int, Channel] = {}
        self._dropped = dropped
        self._subscriptions: dict[int, int] = {}
        """Each subscription with its channel."""
        self._waiting: deque[str | bytes] = deque()
        self._ready = asyncio.Event()

    @property
    def subscribed(self) -> set[int]:
        """The channels that have a subscription."""
        return set(self._subscriptions.values())

    def offer(self, channels: Iterable[Channel]) -> None:
        """Advertise channels."""
        new = {channel.id: channel for channel in channels}
        self.channels |= new
        if new:
            self.send(advertise(new.values()))

    def withdraw(self, ids: Iterable[int]) -> None:
        """Take channels back, with their subscriptions."""
        gone = [number for number in ids if self.channels.pop(number, None) is not None]
        self._subscriptions = {s: c for s, c in self._subscriptions.items() if c not in gone}
        if gone:
            self.send(unadvertise(gone))

    def apply(self, request: Subscribe | Unsubscribe) -> set[int]:
        """Carry out a subscription; return the channels that are subscribed newly."""
        if isinstance(request, Unsubscribe):
            for number in request.subscriptions:
                self._subscriptions.pop(number, None)
            return set()
        known = {s: c for s, c in request.channels.items() if c in self.channels}
        new = set(known.values()) - self.subscribed
        self._subscriptions |= known
        return new

    def publish(self, channel: int, ns: int, payload: bytes) -> None:
        """Send a message of a channel to each of its subscriptions."""
        for subscription, subscribed in self._subscriptions.items():
            if subscribed == channel:
                self.send(message_data(subscription, ns, payload))

    def send(self, message: str | bytes) -> None:
        """Put a message into the queue."""
        if len(self._waiting) >= WAITING:
            self._drop_oldest()
        self._waiting.append(message)
        self._ready.set()

    @property
    def is_full(self) -> bool:
        """Whether a player should wait before it sends more."""
        return len(self._waiting) > WAITING // 2

    def _drop_oldest(self) -> None:
        """Drop the oldest message of a channel; what says how the connection stands is kept."""
        for i, message in enumerate(self._waiting):
            if isinstance(message, bytes):
                del self._waiting[i]
                self._dropped()
                return

    async def send_waiting(self) -> None:
        """Send what waits, until the client leaves."""
        try:
            while True:
                await self._ready.wait()
                while self._waiting:
                    message = self._waiting.popleft()
                    if isinstance(message, str):
                        await self.socket.send_text(message)
                    else:
                        await self.socket.send_bytes(message)
                self._ready.clear()
        except (WebSocketDisconnect, RuntimeError):
            return
