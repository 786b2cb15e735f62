"""A live source: what waits too long is dropped and counted, markers are kept, and a session that ends stops it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import pytest
from shift_runtime.rest_client import RestClient
from shift_schemas.errors import Conflict
from shift_schemas.messages import GazeChunk
from shift_sources.files.samples import Sample
from shift_sources.gaze_forwarder import Batching
from shift_sources.live.feed import Batch
from shift_sources.live.runner import LiveSource, Totals

pytestmark = pytest.mark.anyio


class Replayed:
    """A feed that gives these batches, then nothing."""

    about = "a feed of a test"
    reconnects = 2

    def __init__(self, *batches: Batch) -> None:
        self._batches = list(batches)
        self.closed = False

    def read(self) -> Batch:
        return self._batches.pop(0) if self._batches else Batch()

    def close(self) -> None:
        self.closed = True


class Gateway:
    """The part of the REST client that a source uses; ``on_gaze`` may refuse or wait."""

    def __init__(self, on_gaze: Callable[[GazeChunk], None] = lambda chunk: None, last: int = -1) -> None:
        self.chunks: list[GazeChunk] = []
        self.markers: list[str] = []
        self._on_gaze, self._last = on_gaze, last

    def observation(self, session: str) -> dict[str, Any]:
        return {"seen": {"gaze": {"tx": self._last} if self._last >= 0 else {}}}

    def gaze(self, session: str, chunk: GazeChunk) -> dict[str, Any]:
        self._on_gaze(chunk)
        self.chunks.append(chunk)
        return {"accepted": len(chunk.t)}

    def command(self, kind: type, session: str, text: str) -> None:
        self.markers.append(text)


def samples(first: int, count: int) -> list[Sample]:
    return [Sample((first + i) / 100, 0.5, 0.5, True) for i in range(count)]


async def forwarded(feed: Replayed, gateway: Any, batching: Batching, wait_s: float = 0.3) -> Totals:
    stop, said = asyncio.Event(), list[str]()
    gateway_: RestClient = gateway
    source = LiveSource(feed, gateway_, "s1", "tx", batching)
    asyncio.get_running_loop().call_later(wait_s, stop.set)
    try:
        return await source.run(stop, said.append)
    finally:
        assert said == ["a feed of a test"]
        assert feed.closed


async def test_gaze_and_markers_are_kept_and_numbers_go_on_where_the_source_was() -> None:
    gateway = Gateway(last=6)
    feed = Replayed(Batch(samples(0, 30), ["begin"]), Batch(samples(30, 5)), Batch(markers=["end"]))
    totals = await forwarded(feed, gateway, Batching(10, 0.01))
    assert [t for chunk in gateway.chunks for t in chunk.t] == [i / 100 for i in range(35)]
    assert [chunk.seq for chunk in gateway.chunks] == list(range(7, 7 + len(gateway.chunks)))
    assert gateway.markers == ["begin", "end"]
    assert totals.sentence == "35 samples, 35 kept, 2 markers; connected again 2 times"


async def test_source_that_outruns_the_mesh_drops_its_oldest_samples_and_counts_them() -> None:
    release = asyncio.Event()
    loop = asyncio.get_running_loop()

    def slow(chunk: GazeChunk) -> None:
        asyncio.run_coroutine_threadsafe(release.wait(), loop).result(10)

    gateway = Gateway(slow)
    feed = Replayed(*(Batch(samples(10 * i, 10)) for i in range(20)))
    loop.call_later(0.2, release.set)
    totals = await forwarded(feed, gateway, Batching(10, 0.01, most=50), wait_s=0.5)
    kept = [round(t * 100) for chunk in gateway.chunks for t in chunk.t]
    assert kept == [*range(len(kept) - 50), *range(150, 200)]
    (reason,) = totals.lost
    assert "oldest samples were dropped" in reason
    assert totals.lost[reason] == 200 - len(kept)
    numbers = [chunk.seq for chunk in gateway.chunks]
    assert any(after - before > 1 for before, after in pairwise(numbers)), "the gap has a number"


async def test_session_that_takes_no_more_gaze_stops_the_source() -> None:
    def ended(chunk: GazeChunk) -> None:
        raise Conflict("session s1 has ended")

    with pytest.raises(Conflict, match="has ended"):
        await forwarded(Replayed(Batch(samples(0, 10))), Gateway(ended), Batching(10, 0.01), wait_s=5)


async def test_clock_that_begins_anew_is_forwarded() -> None:
    gateway = Gateway()
    steps = [*samples(1000, 5), *samples(0, 5), *samples(2000, 5)]
    await forwarded(Replayed(Batch(steps)), gateway, Batching(30, 0.01))
    assert [chunk.t[0] for chunk in gateway.chunks] == [10.0, 0.0, 20.0]
