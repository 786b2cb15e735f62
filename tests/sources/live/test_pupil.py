"""Pupil Core, with a server that speaks its protocol: ZeroMQ, msgpack, and the requests of Pupil Remote."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from typing import Any

import msgpack
import pytest
import zmq
from shift_schemas.errors import UnknownThing
from shift_sources.files.samples import Eyes, Sample
from shift_sources.live.pupil import PupilFeed, PupilOptions
from shift_sources.live.pupil_messages import SurfacesAsAois

PUPIL_CLOCK_AHEAD_S = 1000.0


class PupilServer:
    """Pupil Remote and the publisher behind it."""

    def __init__(self, port: int | None = None) -> None:
        self._context = zmq.Context()
        self._remote, self._publisher = self._context.socket(zmq.REP), self._context.socket(zmq.PUB)
        self.port = port or self._remote.bind_to_random_port("tcp://127.0.0.1")
        if port:
            self._remote.bind(f"tcp://127.0.0.1:{port}")
        self._published = self._publisher.bind_to_random_port("tcp://127.0.0.1")
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._answer)
        self._thread.start()

    @property
    def address(self) -> str:
        return f"127.0.0.1:{self.port}"

    def _answer(self) -> None:
        while not self._ended.is_set():
            if self._remote.poll(20):
                text = self._remote.recv_string()
                answers = {"SUB_PORT": str(self._published), "t": repr(time.time() + PUPIL_CLOCK_AHEAD_S)}
                self._remote.send_string(answers.get(text, "Unknown command."))

    def publish(self, topic: str, message: dict[str, Any]) -> None:
        self._publisher.send_multipart([topic.encode(), msgpack.packb({"topic": topic, **message})])

    def close(self) -> None:
        self._ended.set()
        self._thread.join()
        self._context.destroy(linger=0)


@pytest.fixture
def server() -> Iterator[PupilServer]:
    found = PupilServer()
    yield found
    found.close()


def gaze(t: float, x: float = 0.25, y: float = 0.75, confidence: float = 0.9, **more: Any) -> dict[str, Any]:
    return {"timestamp": t, "norm_pos": [x, y], "confidence": confidence, **more}


def read_all(feed: PupilFeed, count: int, publish: Any = None) -> list[Sample]:
    """Read until so many samples came; a subscription needs a moment, so ``publish`` is repeated until the first."""
    found: list[Sample] = []
    until = time.monotonic() + 10
    while len(found) < count and time.monotonic() < until:
        if publish is not None and not found:
            publish()
        found += feed.read().samples
    return found


def test_gaze_has_points_pupils_and_the_measured_clock(server: PupilServer) -> None:
    feed = PupilFeed(PupilOptions(server.address))
    pupils = [{"id": 0, "diameter_3d": 3.5, "diameter": 60.0}, {"id": 1, "diameter": 55.0}]

    def publish() -> None:
        server.publish("gaze.3d.01.", gaze(10.0, base_data=pupils))
        server.publish("pupil.0.3d", gaze(10.5))
        server.publish("gaze.3d.0.", gaze(11.0, confidence=0.3))
        server.publish("gaze.3d.0.", {"timestamp": 11.5, "confidence": 1.0})

    first = feed.read()
    assert first.offset_s == pytest.approx(-PUPIL_CLOCK_AHEAD_S, abs=0.2)
    assert first.round_trip_s is not None
    assert 0 < first.round_trip_s < 1
    found = read_all(feed, 2, publish)
    assert found[0] == Sample(10.0, 0.25, 0.25, True, Eyes(pupil_left=55.0, pupil_right=3.5))
    assert (found[1].t, found[1].valid) == (11.0, False)
    assert "the scene camera" in feed.about
    feed.close()


def surface(name: str, picture: float, *on: tuple[float, bool], confidence: float = 0.9) -> dict[str, Any]:
    looks = [gaze(t, confidence=confidence, on_surf=hit) for t, hit in on]
    return {"name": name, "timestamp": picture, "gaze_on_surfaces": looks}


def test_points_of_one_surface(server: PupilServer) -> None:
    feed = PupilFeed(PupilOptions(server.address, surface="screen"))

    def publish() -> None:
        server.publish("surfaces.screen", surface("screen", 1.0, (1.02, False), (1.01, True)))
        server.publish("surfaces.screen2", surface("screen2", 1.0, (1.01, True)))

    found = read_all(feed, 2, publish)
    assert [(s.t, s.valid, s.y) for s in found[:2]] == [(1.01, True, 0.25), (1.02, False, None)]
    feed.close()


def test_surfaces_are_aois_and_the_first_one_counts() -> None:
    names = {"coffee cup": "cup"}
    joined = SurfacesAsAois(lambda name: names.get(name, name) or None)
    assert joined.add(surface("coffee cup", 1.0, (1.01, True), (1.02, False))) == []
    assert joined.add(surface("table", 1.0, (1.01, True), (1.02, True), (1.03, False))) == []
    done = joined.add(surface("table", 2.0, (2.01, True), confidence=0.2))
    assert [(s.t, s.aoi) for s in done] == [(1.01, "cup"), (1.02, "table"), (1.03, None)]
    assert [s.aoi for s in joined.add(surface("table", 3.0))] == [None]


def test_restart_of_pupil_capture_is_found_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("shift_sources.live.pupil.SILENT_S", 0.3)
    monkeypatch.setattr("shift_sources.live.pupil.REQUEST_S", 0.5)
    first = PupilServer()
    feed = PupilFeed(PupilOptions(first.address))
    assert read_all(feed, 1, lambda: first.publish("gaze.3d.01.", gaze(1.0)))
    first.close()
    second = PupilServer(first.port)
    try:
        (found, *_) = read_all(feed, 1, lambda: second.publish("gaze.3d.01.", gaze(2.0)))
        assert found.t == 2.0
        assert feed.reconnects >= 1
    finally:
        feed.close()
        second.close()


def test_absent_pupil_capture_is_said_with_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("shift_sources.live.pupil.REQUEST_S", 0.2)
    with pytest.raises(UnknownThing, match=r"nobody answers at 127.0.0.1:1: start Pupil Capture.*Network API"):
        PupilFeed(PupilOptions("127.0.0.1:1"))
