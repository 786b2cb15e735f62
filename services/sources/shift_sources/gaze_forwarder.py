"""Forwards the gaze of one session to the monitor. Each chunk is acknowledged before the next one is sent."""

from __future__ import annotations

import asyncio
from collections import OrderedDict
from collections.abc import Awaitable, Callable
from dataclasses import dataclass

import structlog
from shift_runtime.deadline import Deadline
from shift_schemas.errors import MalformedMessage, ShiftError, Unavailable

from shift_sources.completion import Completion
from shift_sources.gaze_batching import MOST_SOURCES, GazeArrival, GazeBuffer, join
from shift_sources.gaze_sink import GazeSink

log = structlog.get_logger()
BACKLOG_CHUNK = 500
"""Chosen: samples of a chunk if they come faster than the monitor acknowledges."""
Attach = Callable[[str], Awaitable[None]]
"""Makes sure that the session exists and is followed. Raises :class:`ShiftError`."""
OnLost = Callable[[str, ShiftError, int], None]
"""Is called with the topic, the reason and the number of samples that were not forwarded."""


@dataclass(frozen=True)
class Batching:
    """How single samples become chunks."""

    samples: int
    """The size of a chunk, in samples."""
    wait_s: float
    """How long samples wait for a chunk to fill, in seconds."""
    most: int = 20_000
    """The most samples that wait: ten seconds at 2000 Hz. Beyond it the oldest are dropped and counted."""


class GazeForwarder:
    """The buffer of one session and the task that empties it."""

    def __init__(self, sink: GazeSink, session: str, batching: Batching, attach: Attach, on_lost: OnLost) -> None:
        self._sink = sink
        self._session = session
        self._batching = batching
        self._attach = attach
        self._on_lost = on_lost
        self._buffer = GazeBuffer()
        self._completion = Completion()
        self._wake = asyncio.Event()
        self._ready = asyncio.Event()
        self._flushing = False
        self._next_seq: OrderedDict[str, int] = OrderedDict()
        self._gaps: set[str] = set()
        """Sources whose next chunk leaves out a number, because samples before it were dropped."""
        self._task = asyncio.get_running_loop().create_task(self._run())

    def put(self, arrival: GazeArrival) -> None:
        """Add an arrival to the queue. Raise :class:`MalformedMessage` if its time does not rise.

        If too many samples wait, the oldest are dropped, and the next chunk leaves out a number, so that the recording
        says that something is missing.
        """
        self._buffer.add(arrival)
        self._completion.receive()
        if self._buffer.samples > self._batching.most:
            self._drop_oldest()
        self._wake.set()
        if self._buffer.is_ready(self._batching.samples):
            self._ready.set()

    def _drop_oldest(self) -> None:
        dropped = self._buffer.drop_oldest(self._batching.most)
        self._completion.finish(len(dropped))
        self._gaps |= {arrival.chunk.source for arrival in dropped if not arrival.numbered}
        error = Unavailable("the mesh does not take gaze as fast as it comes; the oldest samples were dropped")
        self._on_lost("gaze", error, sum(len(arrival.chunk.t) for arrival in dropped))

    @property
    def idle(self) -> bool:
        """Whether nothing waits."""
        return self._completion.idle

    async def flush(self, timeout_s: float) -> bool:
        """Send what has arrived without waiting for more.

        Returns whether all of it was acknowledged or reported as lost, after ``timeout_s`` seconds at most.
        """
        self._flushing = True
        self._ready.set()
        return await self._completion.wait(timeout_s)

    def close(self) -> None:
        """Stop the task."""
        self._task.cancel()

    async def _run(self) -> None:
        while True:
            while not self._buffer:
                self._flushing = False
                self._wake.clear()
                await self._wake.wait()
            if not self._flushing and not self._buffer.is_ready(self._batching.samples):
                await self._wait_for_more()
            size = self._batching.samples
            backlog = self._buffer.samples > 2 * size
            taken = self._buffer.take(BACKLOG_CHUNK if backlog else size)
            try:
                await self._send(taken)
            finally:
                self._completion.finish(len(taken))

    async def _wait_for_more(self) -> None:
        self._ready.clear()
        await Deadline(self._batching.wait_s).is_set(self._ready)

    async def _send(self, taken: list[GazeArrival]) -> None:
        samples = sum(len(a.chunk.t) for a in taken)
        try:
            await self._forward(taken)
        except MalformedMessage as e:
            if len(taken) == 1:
                self._on_lost("gaze", e, samples)
                return
            for one in taken:  # one bad sample must not cost its neighbours
                await self._send([one])
        except ShiftError as e:
            source = taken[0].chunk.source
            if isinstance(e, Unavailable) and not taken[0].numbered and source in self._next_seq:
                self._next_seq[source] += 1  # it may have been taken; if it was not, the monitor counts the gap
            self._on_lost("gaze", e, samples)
        except Exception:
            log.exception("gaze could not be forwarded", session=self._session)
            self._on_lost("gaze", ShiftError("an internal error prevented forwarding the gaze; see the log"), samples)

    async def _forward(self, taken: list[GazeArrival]) -> None:
        await self._attach(self._session)
        if taken[0].numbered:
            chunk = taken[0].chunk
        else:
            source = taken[0].chunk.source
            if source not in self._next_seq:
                self._next_seq[source] = await self._sink.next_seq(self._session, source)
            if source in self._gaps:
                self._gaps.discard(source)
                self._next_seq[source] += 1
            chunk = join(taken, self._next_seq[source])
        await self._sink.gaze(self._session, chunk)
        self._next_seq[chunk.source] = chunk.seq + 1
        self._next_seq.move_to_end(chunk.source)
        if len(self._next_seq) > MOST_SOURCES:
            self._next_seq.popitem(last=False)
