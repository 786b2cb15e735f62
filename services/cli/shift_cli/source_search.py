"""What ``shift-mesh doctor`` finds of gaze sources: streams, devices and topics, each with how to connect it."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from typing import NamedTuple

PUPIL_REMOTE = ("127.0.0.1", 50020)
LSL_S = 1.0
NEON_S = 2.0


class FoundSource(NamedTuple):
    """A source of gaze that is there."""

    what: str
    connect: str
    """How to connect it, in one line."""


def found_sources(router: str) -> Iterator[FoundSource]:
    """Yield the sources that are there. A library that is not installed finds nothing.

    ``router`` is the endpoint of the ROS graph's router: that of the mesh, or another one.
    """
    yield from _lsl()
    yield from _pupil()
    yield from _neon()
    yield from _ros(router)


def _lsl() -> Iterator[FoundSource]:
    from shift_schemas.errors import InvalidSettings
    from shift_sources.live.lsl import found_streams

    try:
        streams = found_streams(LSL_S)
    except InvalidSettings:
        return
    for stream in streams:
        if stream.has_gaze:
            command = f"shift-mesh source lsl --session S --name '{stream.name}'"
            yield FoundSource(f"Lab Streaming Layer: {stream.line}", command)


def _pupil() -> Iterator[FoundSource]:
    try:
        socket.create_connection(PUPIL_REMOTE, timeout=0.5).close()
    except OSError:
        return
    yield FoundSource("Pupil Remote of Pupil Core answers on this computer", "shift-mesh source pupil --session S")


def _neon() -> Iterator[FoundSource]:
    try:
        from pupil_labs.realtime_api import simple
    except ImportError:
        return
    for device in simple.discover_devices(search_duration_seconds=NEON_S):
        with device:
            command = f"shift-mesh source neon --session S --address {device.phone_ip}"
            yield FoundSource(f"Pupil Labs Neon or Invisible at {device.phone_ip}", command)


def _ros(router: str) -> Iterator[FoundSource]:
    from shift_ros2.gaze_topics import find_gaze_topics

    for topic in find_gaze_topics(router):
        how = "shift-mesh ros2 --session S" if topic.name.endswith("shift/gaze") else (
            f"publish its AOI names or points on /shift/gaze, and run shift-mesh ros2 --session S ({topic.type} is "
            "not read directly)"
        )  # fmt: skip
        yield FoundSource(f"ROS 2 topic {topic.name} ({topic.type})", how)
