"""The messages of the Foxglove protocol, byte by byte as its specification has them; nonsense is refused."""

from __future__ import annotations

import contextlib
import json
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shift_gateway.foxglove.protocol import (
    ControlPlayback,
    PlaybackStatus,
    Subscribe,
    Unsubscribe,
    message_data,
    playback_state,
    read_request,
    server_info,
    time_of,
)
from shift_schemas.errors import MalformedMessage


def control(command: int, speed: float, seek: int | None, name: bytes) -> bytes:
    head = struct.pack("<BBfBQI", 3, command, speed, seek is not None, seek or 0, len(name))
    return head + name


def test_binary_messages_of_the_server() -> None:
    assert message_data(7, 2**40 + 1, b"{}") == b"\x01\x07\0\0\0\x01\0\0\0\0\x01\0\0{}"
    assert time_of(258) == b"\x02\x02\x01\0\0\0\0\0\0"
    state = playback_state(PlaybackStatus.ENDED, 5, 2.0, True, "r1")
    assert state == b"\x05\x03" + struct.pack("<Qf", 5, 2.0) + b"\x01\x02\0\0\0r1"


def test_playback_is_offered_for_recordings_only() -> None:
    live = json.loads(server_info("a", "b"))
    assert live["capabilities"] == ["time"]
    assert "dataStartTime" not in live
    recorded = json.loads(server_info("a", "b", (1_500_000_000, 2_000_000_007)))
    assert recorded["capabilities"] == ["time", "playbackControl"]
    assert recorded["dataStartTime"] == {"sec": 1, "nsec": 500_000_000}
    assert recorded["dataEndTime"] == {"sec": 2, "nsec": 7}


def test_requests_of_a_client() -> None:
    raw = '{"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 9}]}'
    assert read_request(raw) == Subscribe({1: 9})
    assert read_request('{"op": "unsubscribe", "subscriptionIds": [1, 2]}') == Unsubscribe((1, 2))
    assert read_request(control(0, 2.0, 77, b"x")) == ControlPlayback(True, 2.0, 77, "x")
    assert read_request(control(1, 1.0, None, b"")) == ControlPlayback(False, 1.0, None, "")


@pytest.mark.parametrize(
    "raw",
    ["", "[]", "{", '{"op": "advertise"}', '{"op": 3}', '{"op": "subscribe"}',
     '{"op": "subscribe", "subscriptions": [1]}',
     '{"op": "subscribe", "subscriptions": [{"id": -1, "channelId": 1}]}',
     '{"op": "subscribe", "subscriptions": [{"id": true, "channelId": 1}]}',
     '{"op": "unsubscribe", "subscriptionIds": ["1"]}', b"", b"\x01abc", b"\x03", control(2, 1.0, None, b""),
     control(0, 0.0, None, b""), control(0, float("nan"), None, b""), control(0, 1.0, None, b"ab")[:-1],
     control(0, 1.0, None, b"\xff")],
)  # fmt: skip
def test_nonsense_is_refused(raw: str | bytes) -> None:
    with pytest.raises(MalformedMessage):
        read_request(raw)


@given(st.binary(max_size=64) | st.text(max_size=64))
def test_anything_is_a_request_or_refused(raw: str | bytes) -> None:
    with contextlib.suppress(MalformedMessage):
        read_request(raw)
