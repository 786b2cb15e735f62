"""Neon, with a stand-in for the interface of Pupil Labs' package: no device was available."""

from __future__ import annotations

import sys
from collections import deque
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest
from shift_schemas.errors import InvalidSettings, UnknownThing
from shift_sources.files.options import ScreenSize
from shift_sources.files.samples import Eyes
from shift_sources.live import neon
from shift_sources.live.neon import NeonFeed, NeonOptions, sample_of


class Device:
    """A device of the simple interface."""

    def __init__(self, address: str = "10.0.0.2", port: str = "8080") -> None:
        if address == "nowhere":
            raise OSError("no route")
        self.phone_ip, self.port = address, port
        self.waiting: deque[Any] = deque()
        self.closed = False

    def receive_gaze_datum(self, timeout_seconds: float) -> Any:
        return self.waiting.popleft() if self.waiting else None

    def estimate_time_offset(self) -> Any:
        return SimpleNamespace(
            time_offset_ms=SimpleNamespace(mean=-250.0), roundtrip_duration_ms=SimpleNamespace(mean=8.0)
        )

    def close(self) -> None:
        self.closed = True


def datum(t: float, x: float = 800.0, y: float = 300.0, worn: bool = True, **more: float) -> Any:
    return SimpleNamespace(x=x, y=y, worn=worn, timestamp_unix_seconds=t, **more)


@pytest.fixture
def devices(monkeypatch: pytest.MonkeyPatch) -> list[Device]:
    """The devices in the network; the package's interface finds the first."""
    there = [Device()]
    simple: Any = ModuleType("pupil_labs.realtime_api.simple")
    simple.Device = Device
    simple.discover_one_device = lambda max_search_duration_seconds: there[0] if there else None
    package: Any = ModuleType("pupil_labs.realtime_api")
    package.simple = simple
    monkeypatch.setitem(sys.modules, "pupil_labs", ModuleType("pupil_labs"))
    monkeypatch.setitem(sys.modules, "pupil_labs.realtime_api", package)
    monkeypatch.setitem(sys.modules, "pupil_labs.realtime_api.simple", simple)
    return there


def test_datum_is_a_share_of_the_scene_camera_s_picture() -> None:
    found = sample_of(datum(5.0, pupil_diameter_left=3.1, eyelid_aperture_right=9.0), ScreenSize(1600, 1200))
    assert (found.t, found.x, found.y, found.valid) == (5.0, 0.5, 0.25, True)
    assert found.eyes == Eyes(pupil_left=3.1, openness_right=9.0)
    assert not sample_of(datum(5.0, worn=False), ScreenSize(1600, 1200)).valid


def test_samples_come_with_the_clock_of_the_device(devices: list[Device]) -> None:
    feed = NeonFeed(NeonOptions())
    devices[0].waiting.extend([datum(1.0), datum(1.005)])
    batch = feed.read()
    assert [s.t for s in batch.samples] == [1.0, 1.005]
    assert (batch.offset_s, batch.round_trip_s) == (-0.25, 0.008)
    assert feed.read().offset_s is None, "the offset is measured now and then"
    feed.close()
    assert devices[0].closed


def test_address_is_used_and_silence_connects_again(devices: list[Device], monkeypatch: pytest.MonkeyPatch) -> None:
    feed = NeonFeed(NeonOptions("10.0.0.9:8081"))
    assert feed.about == "Neon at 10.0.0.9"
    monkeypatch.setattr(neon, "SILENT_S", -1.0)
    assert feed.read().samples == []
    assert feed.reconnects == 1


def test_absent_device_is_said_with_what_to_do(devices: list[Device]) -> None:
    devices.clear()
    with pytest.raises(UnknownThing, match="no Neon answers in the network: phone and computer"):
        NeonFeed(NeonOptions())
    with pytest.raises(UnknownThing, match="no Neon answers in nowhere"):
        NeonFeed(NeonOptions("nowhere"))


def test_missing_package_is_said_with_its_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pupil_labs.realtime_api", None)
    with pytest.raises(InvalidSettings, match=r"pip install 'shift-mesh\[neon\]'"):
        NeonFeed(NeonOptions())
