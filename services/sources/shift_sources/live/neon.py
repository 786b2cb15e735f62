"""Neon and Invisible by Pupil Labs' real-time API. The package is imported late, since it brings video and sound.

No device was available here: the feed is tested with a stand-in for the package's interface.
"""

from __future__ import annotations

import time
from typing import Any, NamedTuple

import structlog
from shift_schemas.errors import InvalidSettings, UnknownThing

from shift_sources.files.options import ScreenSize
from shift_sources.files.samples import Eyes, Sample, lost_sample
from shift_sources.live.feed import Batch

log = structlog.get_logger()
INSTALL = "Neon needs Pupil Labs' real-time API: pip install 'shift-mesh[neon]'"
SCENE = ScreenSize(1600, 1200)
"""The picture of Neon's scene camera, in pixels; that of Invisible has 1088 x 1080."""
PORT = 8080
FIND_S = 10.0
WAIT_S = 0.05
MEASURE_EVERY_S = 30.0
MOST_SAMPLES = 200
SILENT_S = 5.0


EYES = ("pupil_diameter_left", "pupil_diameter_right", "eyelid_aperture_left", "eyelid_aperture_right")
"""Millimetres; only devices that estimate them have these fields."""


class NeonOptions(NamedTuple):
    """What is read."""

    address: str = ""
    """Host of the companion phone, with or without a port; empty: the only one in the network."""
    scene: ScreenSize = SCENE


def load() -> Any:
    """Return the module with the simple interface. Raise :class:`InvalidSettings` if it is not installed."""
    try:
        from pupil_labs.realtime_api import simple
    except ImportError as e:
        raise InvalidSettings(f"{INSTALL} ({e})") from e
    return simple


def sample_of(datum: Any, scene: ScreenSize) -> Sample:
    """Return the sample of one gaze datum: pixels of the scene camera, the time in s since 1970. Pure."""
    eyes = Eyes(*(_number(datum, name) for name in EYES))
    t = float(datum.timestamp_unix_seconds)
    if not datum.worn:
        return lost_sample(t, eyes)
    return Sample(t, datum.x / scene.width, datum.y / scene.height, True, eyes)


class NeonFeed:
    """Reads the gaze of one device.

    Raises
    ------
    UnknownThing
        No device answers.
    InvalidSettings
        The package is missing.
    """

    def __init__(self, options: NeonOptions) -> None:
        self._api, self._options = load(), options
        self.reconnects = 0
        self._measured = 0.0
        self._device = self._found()
        self._last_heard = time.monotonic()
        if self._device is None:
            where = options.address or "the network"
            raise UnknownThing(
                f"no Neon answers in {where}: phone and computer must be in one network; give the address that the "
                "Companion app shows with --address"
            )

    @property
    def about(self) -> str:
        """The device, in a few words; its name is not taken over, since people give their own."""
        return f"Neon at {self._device.phone_ip}" if self._device is not None else "no Neon answers"

    def read(self) -> Batch:
        """Return the samples that came."""
        samples: list[Sample] = []
        wait_s = WAIT_S
        while len(samples) < MOST_SAMPLES:
            datum = self._device.receive_gaze_datum(timeout_seconds=wait_s)
            if datum is None:
                break
            samples.append(sample_of(datum, self._options.scene))
            wait_s = 0.001
        now = time.monotonic()
        if samples:
            self._last_heard = now
        elif now - self._last_heard > SILENT_S:
            self._connect_again(now)
        offset_s, round_trip_s = self._clock(now)
        return Batch(samples, [], False, round_trip_s, offset_s)

    def close(self) -> None:
        """End the connection."""
        if self._device is not None:
            self._device.close()

    def _found(self) -> Any:
        if not self._options.address:
            return self._api.discover_one_device(max_search_duration_seconds=FIND_S)
        host, _, port = self._options.address.partition(":")
        try:
            return self._api.Device(address=host, port=port or str(PORT))
        except Exception as e:  # the package raises errors of several libraries
            log.warning("the device does not answer", address=self._options.address, reason=str(e))
            return None

    def _connect_again(self, now: float) -> None:
        log.warning("no gaze comes from the device; it is connected again")
        self._last_heard = now
        device = self._found()
        if device is not None:
            self._device.close()
            self._device, self.reconnects = device, self.reconnects + 1

    def _clock(self, now: float) -> tuple[float | None, float | None]:
        """Return this computer's clock minus the device's, and the round trip, s; None between two measurements."""
        if now - self._measured < MEASURE_EVERY_S:
            return None, None
        self._measured = now
        estimate = self._device.estimate_time_offset()
        if estimate is None:
            return None, None
        return estimate.time_offset_ms.mean / 1000, estimate.roundtrip_duration_ms.mean / 1000


def _number(datum: Any, name: str) -> float | None:
    value = getattr(datum, name, None)
    return float(value) if value is not None and value == value and value >= 0 else None
