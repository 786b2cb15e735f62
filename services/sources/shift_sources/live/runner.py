"""Runs a live source: reads its feed in a thread, and forwards gaze and markers to the gateway until it is stopped."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, field

import structlog
from shift_runtime.rest_client import RestClient
from shift_schemas.errors import Conflict, ShiftError, UnknownThing
from shift_schemas.messages import Mark

from shift_sources.gaze_forwarder import Batching, GazeForwarder
from shift_sources.live.feed import Chunker, Feed
from shift_sources.live.gateway_sink import GatewaySink

log = structlog.get_logger()
LAST_SAMPLES_S = 20.0
"""How long a source that is stopped may take to send what it has, s; chosen."""
MOST_MARKER_TEXT = 10_000


@dataclass
class Totals:
    """What became of the samples of a source."""

    received: int = 0
    lost: dict[str, int] = field(default_factory=dict)
    """Samples that were not kept, by the reason."""
    markers: int = 0
    out_of_order: int = 0
    reconnects: int = 0

    @property
    def kept(self) -> int:
        """Samples that the mesh acknowledged."""
        return self.received - sum(self.lost.values())

    @property
    def sentence(self) -> str:
        """What the command says at its end."""
        lost = "".join(f"; {count} lost: {reason}" for reason, count in self.lost.items())
        order = f"; {self.out_of_order} left out, because their time did not rise" if self.out_of_order else ""
        again = f"; connected again {self.reconnects} times" if self.reconnects else ""
        markers = f", {self.markers} markers" if self.markers else ""
        return f"{self.received} samples, {self.kept} kept{markers}{lost}{order}{again}"


class LiveSource:
    """Forwards one feed into one session.

    Parameters
    ----------
    rest
        The client of the gateway; its patience is how long the mesh may be away.
    source
        The name of the gaze source.
    """

    def __init__(self, feed: Feed, rest: RestClient, session: str, source: str, batching: Batching) -> None:
        self._feed, self._rest, self._session = feed, rest, session
        self._batching = batching
        self._chunker = Chunker(source)
        self._markers: asyncio.Queue[str] = asyncio.Queue()
        self._refused: ShiftError | None = None
        self.totals = Totals()

    async def run(self, stop: asyncio.Event, tell: Callable[[str], None]) -> Totals:
        """Forward until ``stop`` is set, or the session takes no more gaze. Return what became of the samples.

        Raises
        ------
        ShiftError
            The session does not exist, has ended, or another source took its place.
        """
        forwarder = GazeForwarder(GatewaySink(self._rest), self._session, self._batching, _attached, self._on_lost)
        markers = asyncio.create_task(self._send_markers())
        about = ""
        try:
            while not stop.is_set() and self._refused is None:
                batch = await asyncio.to_thread(self._feed.read)
                if (now := self._feed.about) != about:
                    about = now
                    tell(about)
                for arrival in self._chunker.arrivals(batch):
                    self.totals.received += len(arrival.chunk.t)
                    forwarder.put(arrival)
                for text in batch.markers:
                    self._markers.put_nowait(text)
            await forwarder.flush(LAST_SAMPLES_S)
            await asyncio.wait_for(self._markers.join(), LAST_SAMPLES_S)
        finally:
            forwarder.close()
            markers.cancel()
            await asyncio.to_thread(self._feed.close)
            self.totals.out_of_order, self.totals.reconnects = self._chunker.out_of_order, self._feed.reconnects
        if self._refused is not None:
            raise self._refused
        return self.totals

    def _on_lost(self, topic: str, error: ShiftError, samples: int) -> None:
        self.totals.lost[error.detail] = self.totals.lost.get(error.detail, 0) + samples
        log.warning("gaze was lost", samples=samples, reason=error.detail)
        if isinstance(error, (Conflict, UnknownThing)):
            self._refused = error

    async def _send_markers(self) -> None:
        while True:
            text = await self._markers.get()
            try:
                await asyncio.to_thread(self._rest.command, Mark, self._session, text=text[:MOST_MARKER_TEXT])
                self.totals.markers += 1
            except ShiftError as e:
                log.warning("a marker was lost", text=text, reason=e.detail)
            finally:
                self._markers.task_done()


async def _attached(session: str) -> None:
    """Do nothing: the gateway looks for the session itself."""
