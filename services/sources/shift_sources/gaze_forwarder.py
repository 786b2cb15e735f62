"""Sends the gaze of one session to the monitor, chunk by chunk, each acknowledged before the next."""

from __future__ import annotations

import asyncio
from collections import OrderedDict
from collections.abc import Awaitable, Callable

import structlog
from shift_runtime.mesh_api import MeshApi
from shift_schemas.errors import MalformedMessage, ShiftError, Unavailable

from shift_ros2.completion import Progress
from shift_ros2.gaze_batching import SOURCES, Lane, joined
from shift_ros2.mapping import GazeArrival
from shift_ros2.settings import BridgeSettings

log = structlog.get_logger()
BACKLOG_CHUNK = 500
"""Chosen: samples of a chunk where they came faster than the monitor acknowledges."""
Lost = Callable[[str, ShiftError, int], None]


class GazeSender:
    """One lane and the task that empties it. ``attach`` makes sure of the session; ``lost`` is told what fell out."""

    def __init__(
        self, door: MeshApi, settings: BridgeSettings, session: str,
        attach: Callable[[str], Awaitable[None]], lost: Lost,
    ) -> None:  # fmt: skip
        self._door = door
        self._settings = settings
        self._session = session
        self._attach = attach
        self._lost = lost
        self._lane = Lane()
        self._progress = Progress()
        self._wake = asyncio.Event()
        self._ripe = asyncio.Event()
        self._hurried = False
        self._next_seq: OrderedDict[str, int] = OrderedDict()
        self._task = asyncio.get_running_loop().create_task(self._run())

    def put(self, arrival: GazeArrival) -> None:
        """Send it in its turn. Raises :class:`MalformedMessage`."""
        self._lane.add(arrival)
        self._progress.came()
        self._wake.set()
        if self._lane.ripe(self._settings.gaze_chunk):
            self._ripe.set()

    @property
    def quiet(self) -> bool:
        """Whether nothing waits."""
        return self._progress.quiet

    async def passed(self, wait_s: float) -> bool:
        """Send what has arrived without waiting for more; whether the monitor has it, or it fell out."""
        self._hurried = True
        self._ripe.set()
        return await self._progress.passed(wait_s)

    def close(self) -> None:
        """Stop."""
        self._task.cancel()

    async def _run(self) -> None:
        while True:
            while not self._lane:
                self._hurried = False
                self._wake.clear()
                await self._wake.wait()
            if not self._hurried and not self._lane.ripe(self._settings.gaze_chunk):
                await self._more()
            chunk_size = self._settings.gaze_chunk
            backlog = self._lane.samples > 2 * chunk_size
            taken = self._lane.take(BACKLOG_CHUNK if backlog else chunk_size)
            try:
                await self._send(taken)
            finally:
                self._progress.done(len(taken))

    async def _more(self) -> None:
        """Let samples gather."""
        self._ripe.clear()
        try:
            await asyncio.wait_for(self._ripe.wait(), self._settings.gaze_wait_s)
        except TimeoutError:
            return

    async def _send(self, taken: list[GazeArrival]) -> None:
        samples = sum(len(a.chunk.t) for a in taken)
        try:
            await self._hand_on(taken)
        except MalformedMessage as e:
            if len(taken) == 1:
                self._lost("gaze", e, samples)
                return
            for one in taken:  # one bad sample must not cost its neighbours
                await self._send([one])
        except ShiftError as e:
            source = taken[0].chunk.source
            if isinstance(e, Unavailable) and not taken[0].numbered and source in self._next_seq:
                self._next_seq[source] += 1  # whether it came in or not: where it did not, the gap is seen
            self._lost("gaze", e, samples)
        except Exception:
            log.exception("gaze could not be handed on", session=self._session)
            self._lost("gaze", ShiftError("something went wrong inside the bridge; see its log"), samples)

    async def _hand_on(self, taken: list[GazeArrival]) -> None:
        await self._attach(self._session)
        if taken[0].numbered:
            chunk = taken[0].chunk
        else:
            source = taken[0].chunk.source
            if source not in self._next_seq:
                self._next_seq[source] = await self._first_seq(source)
            chunk = joined(taken, self._next_seq[source])
        await self._door.gaze(self._session, chunk)
        self._next_seq[chunk.source] = chunk.seq + 1
        self._next_seq.move_to_end(chunk.source)
        if len(self._next_seq) > SOURCES:
            self._next_seq.popitem(last=False)

    async def _first_seq(self, source: str) -> int:
        """Where the source's numbers go on: another bridge, or this one before a restart, may have begun them."""
        replica = self._door.read_model
        view = await replica.view(self._session)
        if not await replica.reader.pull("monitor"):
            raise Unavailable("the monitor does not answer, so nobody knows how far this gaze source came")
        return view.observation.seen.gaze.get(source, -1) + 1 if view.observation else 0
