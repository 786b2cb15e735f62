"""A recording for a Foxglove client, with playback control: play, pause, speed and seek."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Iterable, Iterator
from itertools import islice
from pathlib import Path

from shift_recording.mcap.reader import RecordedMessage, Recording
from shift_recording.mcap.schemas import schema_name, subject_schemas
from shift_schemas.codec import decode
from shift_schemas.errors import DamagedRecording, MalformedMessage
from shift_schemas.messages import Config, Policy
from shift_schemas.registry import SUBJECTS
from shift_schemas.timestamps import NS
from shift_study.loading import study_from_json
from shift_study.study import Study

from shift_gateway.foxglove.connection import Connection
from shift_gateway.foxglove.protocol import (
    Channel,
    ControlPlayback,
    Level,
    PlaybackStatus,
    Request,
    playback_state,
    status,
    time_of,
)

BATCH = 256
"""Messages that are read at once, in a thread of their own."""
LOOK_EVERY_S = 0.05
"""How often a waiting player looks for a request; chosen, as a person notices a delay."""


class Extent:
    """The first and the last time of a recording, ns, its study, and the states of its first policy."""

    def __init__(self, path: Path) -> None:
        self.first = self.last = 0
        self.study: Study | None = None
        self.states: tuple[str, ...] = ()
        for message in Recording(path).messages():
            self.first = self.first or message.log_time
            self.last = max(self.last, message.log_time)
            if message.topic == "config" and self.study is None:
                self.study = study_from_json(decode(Config, message.data).study)
            elif message.topic == "policy" and not self.states:
                self.states = tuple(decode(Policy, message.data).states)
        if not self.first:
            raise DamagedRecording(f"{path.name} holds no messages")


class Playback:
    """The player of one client. It is paused at the beginning, as the client's controls are."""

    def __init__(self, connection: Connection, path: Path, extent: Extent) -> None:
        self._connection = connection
        self._path = path
        self._extent = extent
        self._position = extent.first
        self._playing = False
        self._speed = 1.0
        self._ended = False
        self._seek: int | None = None
        self._wake = asyncio.Event()
        schemas = subject_schemas(extent.study, extent.states)
        connection.offer(
            Channel(i, f"/{subject}", schema_name(subject), schemas[subject].decode())
            for i, subject in enumerate(SUBJECTS, 1)
        )
        self._say()

    def apply(self, request: Request) -> None:
        """Carry out a request, and answer a control with the state."""
        if not isinstance(request, ControlPlayback):
            self._connection.apply(request)
            return
        self._playing, self._speed = request.play, request.speed
        if request.seek_ns is not None:
            self._seek = min(max(request.seek_ns, self._extent.first), self._extent.last)
            self._position, self._ended = self._seek, False
        elif request.play and self._ended:
            self._seek = self._position = self._extent.first
            self._ended = False
        self._say(request.seek_ns is not None, request.request_id)
        self._wake.set()

    def _say(self, did_seek: bool = False, request_id: str = "") -> None:
        what = PlaybackStatus.PLAYING if self._playing else PlaybackStatus.PAUSED
        what = PlaybackStatus.ENDED if self._ended else what
        self._connection.send(playback_state(what, self._position, self._speed, did_seek, request_id))

    async def run(self) -> None:
        """Play as the client asks, until this is cancelled."""
        self._seek = self._extent.first
        while True:
            if self._seek is None:
                await self._woken()
                continue
            start, self._seek = self._seek, None
            try:
                await self._play_from(start)
            except (DamagedRecording, MalformedMessage) as e:
                self._connection.send(status(Level.ERROR, f"{self._path.name}: {e.detail}"))
                self._playing = False
                self._say()

    async def _play_from(self, start: int) -> None:
        """Send the latest message of each topic before ``start``, then the messages after it at their times."""
        messages, latest = Recording(self._path).messages(), dict[str, RecordedMessage]()
        begun = False
        while batch := await asyncio.to_thread(_take, messages):
            for message in batch:
                if message.log_time < start:
                    latest[message.topic] = message
                    continue
                if not begun:
                    self._send_all(latest.values())
                    begun = True
                if not await self._until(message.log_time):
                    return
                self._send_all((message,))
        self._position, self._ended, self._playing = self._extent.last, True, False
        self._say()

    def _send_all(self, messages: Iterable[RecordedMessage]) -> None:
        for message in messages:
            channel = SUBJECTS.index(message.topic) + 1
            self._connection.publish(channel, message.log_time, message.data)

    async def _until(self, ns: int) -> bool:
        """Wait until the position is reached; return False if the client went elsewhere meanwhile."""
        while self._seek is None:
            left_s = (ns - self._position) / NS / self._speed
            if self._playing and left_s <= 0 and not self._connection.is_full:
                return True
            started = asyncio.get_running_loop().time()
            await self._woken(min(max(left_s, 0.001), LOOK_EVERY_S) if self._playing else None)
            if self._playing:
                passed = asyncio.get_running_loop().time() - started
                self._position = min(self._position + round(passed * self._speed * NS), max(ns, self._position))
                self._connection.send(time_of(self._position))
        return False

    async def _woken(self, timeout_s: float | None = None) -> None:
        """Wait for a request, at most so long."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(timeout_s):
                await self._wake.wait()
        self._wake.clear()


def _take(messages: Iterator[RecordedMessage]) -> list[RecordedMessage]:
    return list(islice(messages, BATCH))
