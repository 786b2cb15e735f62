"""``/foxglove`` with a client that is not ours, and playback control byte by byte."""

from __future__ import annotations

import asyncio
import contextlib
import json
import struct
from collections.abc import Callable, Coroutine
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest
import websockets
from robo_ws_bridge import WebSocketBridgeClient
from shift_recording.mcap.reader import Recording
from shift_recording.mcap.schemas import subject_schemas
from shift_runtime.rest_client import RestClient
from shift_schemas.messages import GazeChunk
from shift_schemas.registry import SUBJECTS
from support.whole_mesh import LiveMesh
from websockets.typing import Subprotocol

SOON_S = 20
PROTOCOLS = ("foxglove.websocket.v1", "foxglove.sdk.v1")


def address(mesh: LiveMesh, query: str = "") -> str:
    return f"{mesh.url.replace('http', 'ws')}/foxglove{query}"


async def until(there: Callable[[], Any]) -> None:
    async with asyncio.timeout(SOON_S):
        while not there():  # noqa: ASYNC110
            await asyncio.sleep(0.01)


async def until_closed(socket: Any) -> list[str | bytes]:
    """Return what is received until the server closes the connection."""
    found: list[str | bytes] = []
    with contextlib.suppress(websockets.exceptions.ConnectionClosed):
        async for raw in socket:
            found.append(raw)
    return found


class Client:
    """The client of the package ``robo-ws-bridge``, and what it received."""

    def __init__(self, url: str, protocol: str) -> None:
        self.client = WebSocketBridgeClient(url, subprotocol=protocol)
        self.info: list[Any] = []
        self.messages: list[tuple[str, int, dict[str, Any]]] = []
        self.statuses: list[str] = []
        self.gone: list[str] = []
        self.client.on_server_info(lambda *given: self.info.append(given))
        self.client.on_message(lambda channel, ns, data: self.messages.append((channel["topic"], ns, json.loads(data))))
        self.client.on_status(lambda level, text, name: self.statuses.append(text))
        self.client.on_channel_unadvertised(lambda channel: self.gone.append(channel["topic"]))

    @property
    def topics(self) -> set[str]:
        return {channel["topic"] for channel in self.client.channels.values()}

    async def __aenter__(self) -> Client:
        await self.client.connect()
        await until(lambda: self.info)
        return self

    async def __aexit__(self, *given: object) -> None:
        await self.client.disconnect()

    def of(self, topic: str) -> list[dict[str, Any]]:
        return [message for name, _, message in self.messages if name == topic]


def run(scenario: Callable[[], Coroutine[Any, Any, None]]) -> None:
    asyncio.run(scenario())


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_client_sees_a_running_session(mesh: LiveMesh, protocol: str) -> None:
    name = f"live-{protocol.split('.')[1]}"

    async def scenario() -> None:
        with RestClient(mesh.url) as shift:
            shift.start("P01", session=name, study="coffee", seed=7)
            async with Client(address(mesh, f"?session={name}"), protocol) as seen:
                await until(lambda: len(seen.topics) == len(SUBJECTS))
                assert seen.topics == {f"/{subject}" for subject in SUBJECTS}
                for topic in ("/session", "/decision", "/observation", "/policy"):
                    await seen.client.subscribe(topic)
                await until(lambda: seen.of("/session") and seen.of("/policy"))
                assert seen.of("/session")[0]["participant"] == "P01", "the latest one comes at the subscription"
                decision = await asyncio.to_thread(shift.decide, name, "grasp", "d1")
                await until(lambda: seen.of("/decision"))
                (found,) = seen.of("/decision")
                assert (found["decision_id"], found["strategy"]) == ("d1", decision["strategy"])
                assert "reason" in found
                assert None not in found.values(), "left out, as in a recording: the schema has no null"
                t, ns = found["stamp"], next(ns for topic, ns, _ in seen.messages if topic == "/decision")
                assert ns == t["sec"] * 10**9 + t["nsec"]
                chunk = GazeChunk(source="tx", seq=0, t=[0.0, 0.1], aoi=["robot", None])
                await asyncio.to_thread(shift.gaze, name, chunk)
                await until(lambda: seen.of("/observation")[-1]["seen"]["gaze"] == {"tx": 0})
                assert not any(message for topic, _, message in seen.messages if topic == "/gaze"), "not subscribed"
                schema = json.loads(
                    next(c["schema"] for c in seen.client.channels.values() if c["topic"] == "/decision")
                )
                assert schema["title"] == "shift.Decision.v1"
                assert schema == json.loads(subject_schemas()["decision"]) | {"properties": schema["properties"]}
            await asyncio.to_thread(shift.end, name)

    run(scenario)


def test_sessions_are_offered_as_they_begin_and_taken_back_as_they_end(mesh: LiveMesh) -> None:
    async def scenario() -> None:
        with RestClient(mesh.url) as shift:
            async with Client(address(mesh), PROTOCOLS[0]) as seen:
                await asyncio.to_thread(shift.start, "P02", session="later", study="coffee")
                await until(lambda: "/later/decision" in seen.topics)
                await seen.client.subscribe("/later/session")
                await until(lambda: seen.of("/later/session"))
                await asyncio.to_thread(shift.end, "later")
                await until(lambda: "/later/decision" in seen.gone)

    run(scenario)


@pytest.fixture(scope="module")
def recording(mesh: LiveMesh) -> Path:
    with RestClient(mesh.url) as shift:
        shift.start("P03", session="played", study="coffee", seed=3)
        for n in range(6):
            shift.gaze("played", GazeChunk(source="tx", seq=n, t=[n + i / 10 for i in range(8)], aoi=["robot"] * 8))
            decision = shift.decide("played", "grasp")
            shift.report("played", decision["decision_id"], True, 4.0, n % 2 == 0, 5.0)
        shift.end("played")
    return mesh.data / "recordings" / "played.mcap"


def control(command: int, speed: float, seek: int | None = None, name: str = "r") -> bytes:
    head = struct.pack("<BBfBQI", 3, command, speed, seek is not None, seek or 0, len(name))
    return head + name.encode()


class Player:
    """A client of a recording that controls its playback, by the bytes of the specification."""

    def __init__(self, socket: Any) -> None:
        self.socket = socket
        self.texts: list[dict[str, Any]] = []
        self.states: list[tuple[int, int, float, int, str]] = []
        self.messages: list[tuple[int, int, bytes]] = []

    async def receive(self) -> None:
        async for raw in self.socket:
            if isinstance(raw, str):
                self.texts.append(json.loads(raw))
            elif raw[0] == 5:
                status, at, speed, seeks, length = struct.unpack_from("<BQfBI", raw, 1)
                self.states.append((status, at, speed, seeks, raw[19 : 19 + length].decode()))
            elif raw[0] == 1:
                subscription, ns = struct.unpack_from("<IQ", raw, 1)
                self.messages.append((subscription, ns, raw[13:]))


@asynccontextmanager
async def playing(mesh: LiveMesh, name: str) -> Any:
    protocols = [Subprotocol(PROTOCOLS[1])]
    async with websockets.connect(address(mesh, f"?recording={name}"), subprotocols=protocols) as socket:
        player = Player(socket)
        receiving = asyncio.create_task(player.receive())
        await until(lambda: len(player.texts) == 2 and player.states)
        channels = player.texts[1]["channels"]
        subscriptions = [{"id": channel["id"] + 100, "channelId": channel["id"]} for channel in channels]
        await socket.send(json.dumps({"op": "subscribe", "subscriptions": subscriptions}))
        yield player
        receiving.cancel()


def test_recording_is_played_sought_and_paused(mesh: LiveMesh, recording: Path) -> None:
    whole = list(Recording(recording).messages())
    first, last = whole[0].log_time, max(m.log_time for m in whole)

    async def scenario() -> None:
        async with playing(mesh, recording.name) as player:
            info = player.texts[0]
            assert "playbackControl" in info["capabilities"]
            assert info["dataStartTime"] == {"sec": first // 10**9, "nsec": first % 10**9}
            assert info["dataEndTime"] == {"sec": last // 10**9, "nsec": last % 10**9}
            assert player.states == [(1, first, 1.0, 0, "")], "paused at the beginning"
            await player.socket.send(control(0, 100.0, name="play"))
            await until(lambda: player.states[-1][0] == 3)
            assert (0, first, 100.0, 0, "play") in player.states
            names = {channel["id"] + 100: channel["topic"][1:] for channel in player.texts[1]["channels"]}
            assert [(names[s], ns, data) for s, ns, data in player.messages] == [
                (m.topic, m.log_time, m.data) for m in whole
            ]
            player.messages.clear()
            middle = whole[len(whole) // 2].log_time
            await player.socket.send(control(1, 1.0, middle, "seek"))
            await until(lambda: player.states[-1] == (1, middle, 1.0, 1, "seek"))
            before = {m.topic: m.data for m in whole if m.log_time < middle}
            await until(lambda: len(player.messages) >= len(before))
            assert {names[s]: data for s, _, data in player.messages} == before, "the latest of each topic"
            await asyncio.sleep(0.2)
            assert len(player.messages) == len(before), "paused"
            await player.socket.send(control(0, 100.0, None, "go"))
            after = [(m.topic, m.data) for m in whole if m.log_time >= middle]
            await until(lambda: player.states[-1][0] == 3)
            assert [(names[s], data) for s, _, data in player.messages[len(before) :]] == after

    run(scenario)


def test_what_is_not_valid_is_answered_with_a_warning_and_the_connection_stays(mesh: LiveMesh, recording: Path) -> None:
    async def scenario() -> None:
        async with playing(mesh, recording.name) as player:
            await player.socket.send("nonsense")
            await player.socket.send(b"\x03")
            await until(lambda: len([t for t in player.texts if t["op"] == "status"]) == 2)
            await player.socket.send(control(1, 1.0, name="still there"))
            await until(lambda: player.states[-1][4] == "still there")

    run(scenario)


@pytest.mark.parametrize(
    ("query", "says"),
    [("?session=nowhere", "nowhere"), ("?recording=nowhere.mcap", "there is no recording"), ("?x=1", "is not known"),
     ("?session=**", "not an id")],
)  # fmt: skip
def test_what_is_not_there_is_refused_with_a_sentence(mesh: LiveMesh, query: str, says: str) -> None:
    async def scenario() -> None:
        protocols = [Subprotocol(name) for name in PROTOCOLS]
        async with websockets.connect(address(mesh, query), subprotocols=protocols) as socket:
            texts = [json.loads(raw) for raw in await until_closed(socket)]
        assert texts[-1]["op"] == "status"
        assert says in texts[-1]["message"]
        assert socket.close_code == 1008

    run(scenario)


def test_client_of_another_protocol_is_refused(mesh: LiveMesh) -> None:
    async def scenario() -> None:
        async with websockets.connect(address(mesh)) as socket:
            assert await until_closed(socket) == []
        assert socket.close_code == 1002
        assert "foxglove.sdk.v1" in (socket.close_reason or "")

    run(scenario)


def test_other_origin_is_refused(mesh: LiveMesh) -> None:
    async def scenario() -> None:
        protocols = [Subprotocol(PROTOCOLS[0])]
        with pytest.raises(websockets.exceptions.InvalidStatus):
            async with websockets.connect(address(mesh), subprotocols=protocols, origin="https://elsewhere.example"):  # type: ignore[arg-type]
                pass

    run(scenario)
