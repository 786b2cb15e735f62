"""Pupil Core (Pupil Capture, Pupil Service): gaze over ZeroMQ and msgpack. Both libraries are imported late.

Pupil Remote answers requests at a port: ``SUB_PORT`` is where to subscribe, ``t`` the time of Pupil's clock.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import structlog
from shift_schemas.errors import InvalidSettings, UnknownThing

from shift_sources.files.samples import Sample
from shift_sources.live.feed import Batch
from shift_sources.live.pupil_messages import GAZE, SURFACES, SurfacesAsAois, scene_sample, surface_samples

log = structlog.get_logger()
INSTALL = "Pupil Core needs pyzmq and msgpack: pip install 'shift-mesh[pupil]'"
REQUEST_S = 2.0
"""How long Pupil Remote may take to answer, s."""
WAIT_MS = 20
SILENT_S = 3.0
"""Without a message for so long, Pupil Remote is asked again whether it is there, s; chosen."""
MEASURE_EVERY_S = 5.0
MOST_MESSAGES = 2000


@dataclass(frozen=True)
class PupilOptions:
    """What is read."""

    address: str = "127.0.0.1:50020"
    """Host and port of Pupil Remote."""
    surface: str = ""
    """The surface whose points are taken; empty: the picture of the scene camera."""
    surfaces: bool = False
    """Whether the names of surfaces are taken as AOI names."""
    aoi_map: tuple[tuple[str, str], ...] = ()


def load() -> tuple[Any, Any]:
    """Return the modules ``zmq`` and ``msgpack``. Raise :class:`InvalidSettings` if they are not installed."""
    try:
        import msgpack
        import zmq
    except ImportError as e:
        raise InvalidSettings(f"{INSTALL} ({e})") from e
    return zmq, msgpack


class PupilFeed:
    """Reads the gaze of Pupil Core. It connects again where Pupil Capture was restarted.

    Raises
    ------
    UnknownThing
        Nobody answers at the address.
    InvalidSettings
        The libraries are missing.
    """

    def __init__(self, options: PupilOptions) -> None:
        self._zmq, self._msgpack = load()
        self._options = options
        self._names = dict(options.aoi_map)
        self._aois = SurfacesAsAois(lambda name: self._names.get(name, name) or None)
        self.reconnects = 0
        self._socket: Any = None
        self._last_heard = self._measured = 0.0
        if not self._connect():
            raise UnknownThing(
                f"nobody answers at {options.address}: start Pupil Capture, switch on its plugin Network API, and give "
                "its address with --address"
            )

    @property
    def about(self) -> str:
        """What is read, in a few words."""
        what = "surfaces as AOIs" if self._options.surfaces else self._options.surface or "the scene camera's picture"
        return f"Pupil Core at {self._options.address}: gaze on {what}"

    def read(self) -> Batch:
        """Return the samples that came."""
        samples: list[Sample] = []
        now = time.monotonic()
        if self._socket.poll(WAIT_MS):
            self._last_heard = now
            for _ in range(MOST_MESSAGES):
                try:
                    topic, payload, *_ = self._socket.recv_multipart(self._zmq.NOBLOCK)
                except self._zmq.Again:
                    break
                samples += self._samples(topic.decode(errors="replace"), payload)
        elif now - self._last_heard > SILENT_S:
            self._last_heard = now
            self._connect_again()
        offset_s, round_trip_s = self._clock(now)
        return Batch(samples, [], self._options.surfaces, round_trip_s, offset_s)

    def close(self) -> None:
        """Close the connection."""
        self._socket.close(linger=0)

    def _samples(self, topic: str, payload: bytes) -> list[Sample]:
        try:
            message = self._msgpack.unpackb(payload, raw=False)
            if topic.startswith(GAZE):
                return [scene_sample(message)]
            if self._options.surfaces:
                return self._aois.add(message)
            return surface_samples(message) if message["name"] == self._options.surface else []
        except (KeyError, TypeError, ValueError, self._msgpack.UnpackException) as e:
            log.warning("a message of Pupil Core is left out", topic=topic, reason=repr(e))
            return []

    # --- Pupil Remote ---

    def _ask(self, text: str) -> str | None:
        """Return Pupil Remote's answer; None if it does not come in time."""
        with self._zmq.Context.instance().socket(self._zmq.REQ) as request:
            request.setsockopt(self._zmq.LINGER, 0)
            request.connect(f"tcp://{self._options.address}")
            request.send_string(text)
            return str(request.recv_string()) if request.poll(int(REQUEST_S * 1000)) else None

    def _connect(self) -> bool:
        port = self._ask("SUB_PORT")
        if port is None:
            return False
        host = self._options.address.rpartition(":")[0]
        fresh = self._zmq.Context.instance().socket(self._zmq.SUB)
        fresh.setsockopt(self._zmq.RCVHWM, 100_000)
        fresh.connect(f"tcp://{host}:{port}")
        scene = not self._options.surface and not self._options.surfaces
        fresh.subscribe(GAZE if scene else f"{SURFACES}{self._options.surface}")
        if self._socket is not None:
            self._socket.close(linger=0)
        self._socket, self._last_heard = fresh, time.monotonic()
        return True

    def _connect_again(self) -> None:
        log.warning("no gaze comes from Pupil Core; it is asked again", address=self._options.address)
        if self._connect():
            self.reconnects += 1

    def _clock(self, now: float) -> tuple[float | None, float | None]:
        """Return this computer's clock minus Pupil's, and the round trip, s; None between two measurements."""
        if now - self._measured < MEASURE_EVERY_S:
            return None, None
        self._measured = now
        before, begun = time.time(), time.monotonic()
        answer = self._ask("t")
        round_trip_s = time.monotonic() - begun
        try:
            return before + round_trip_s / 2 - float(answer or ""), round_trip_s
        except ValueError:
            return None, None
