"""Bad input, floods and kills: counted, reported, never fatal; nothing that was acknowledged is lost."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import pytest
import zenoh
from shift_recording.mcap.reader import Recording
from shift_ros2 import cdr
from shift_ros2.rmw_zenoh import NO_HASH, STRING, TRIGGER, Attachment, RosType, data_key
from shift_runtime.bus.zenoh_config import zenoh_config
from support.ros_rig import Bridge, Peer, peer
from support.whole_mesh import LiveMesh, running_mesh

pytestmark = pytest.mark.timeout(280)
RESULT = {"success": True, "duration_s": 2.5}
GID = bytes(range(16))
FLOOD = 80_000


@pytest.fixture(scope="module")
def mesh(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LiveMesh]:
    with running_mesh(tmp_path_factory.mktemp("mesh")) as found:
        yield found


class Wire:
    """A Zenoh session that writes and reads the bytes itself."""

    def __init__(self, router: str) -> None:
        self.session = zenoh.open(zenoh_config("client", connect=router, timeout_ms=5000))
        self.diagnostics: list[dict[str, Any]] = []
        self.samples: list[tuple[bytes, bytes]] = []
        self._diagnosing = self.session.declare_subscriber(
            data_key(0, "/shift/diagnostics", STRING, "*"),
            lambda s: self.diagnostics.append(json.loads(cdr.decode_string(s.payload.to_bytes()))),
        )
        self._hearing = self.session.declare_subscriber("0/shift/**", self._on_sample)
        self.sequence = 0

    def _on_sample(self, sample: zenoh.Sample) -> None:
        if b"gaze" not in str(sample.key_expr).encode().split(b"/")[2:3]:
            self.samples.append((sample.payload.to_bytes(), sample.attachment.to_bytes() if sample.attachment else b""))

    def attachment(self) -> bytes:
        self.sequence += 1
        return Attachment(self.sequence, time.time_ns(), GID).encode()

    def put(
        self, topic: str, text: str | bytes, *, hash: str = STRING.hash, attachment: bytes | None = b"?",
        kind: RosType = STRING,
    ) -> None:  # fmt: skip
        payload = text if isinstance(text, bytes) else cdr.encode_string(text)
        found = self.attachment() if attachment == b"?" else attachment
        self.session.put(data_key(0, topic, kind, hash), payload, attachment=found)

    def call(
        self, payload: bytes = cdr.TRIGGER_REQUEST, *, hash: str = TRIGGER.hash, attachment: bytes | None = b"?"
    ) -> Any:
        """(reply, its attachment); or the error's text; or none."""
        found = self.attachment() if attachment == b"?" else attachment
        replies = self.session.get(
            data_key(0, "/shift/next_strategy", TRIGGER, hash), payload=payload, attachment=found, timeout=5,
            target=zenoh.QueryTarget.ALL_COMPLETE, consolidation=zenoh.ConsolidationMode.NONE,
        )  # fmt: skip
        for reply in replies:
            if reply.ok is not None:
                attached = reply.ok.attachment.to_bytes() if reply.ok.attachment else b""
                return cdr.decode_trigger_response(reply.ok.payload.to_bytes()), attached
            return reply.err.payload.to_string()
        return None

    def dropped(self, topic: str, reason: str) -> int:
        return int(self.diagnostics[-1]["dropped"].get(topic, {}).get(reason, 0)) if self.diagnostics else 0

    def close(self) -> None:
        self.session.close()


@contextmanager
def wire(bridge: Bridge) -> Iterator[Wire]:
    found = Wire(bridge.router)
    try:
        yield found
    finally:
        found.close()


def eventually(what: Callable[[], Any], wait_s: float = 15.0) -> None:
    until = time.monotonic() + wait_s
    while not what():
        assert time.monotonic() < until
        time.sleep(0.05)


GOOD = {"t": 1.0, "aoi": "left"}
BAD_GAZE: list[tuple[str, dict[str, Any], str]] = [
    ("{nonsense", {}, "body"),
    ("[1, 2]", {}, "data"),
    ('{"t": NaN, "aoi": "left"}', {}, "NaN"),
    ('{"t": 1e999, "aoi": "left"}', {}, "t"),
    ('{"t": 1, "t": 2, "aoi": "left"}', {}, "twice"),
    ('{"t": true, "aoi": "left"}', {}, "t"),
    ('{"t": 1.0, "aoi": "left", "colour": 3}', {}, "colour"),
    ('{"t": 1.0, "x": 0.5}', {}, "aoi"),
    ('{"t": [2.0, 1.0], "aoi": ["left", "left"]}', {}, "rise"),
    ('{"t": 1.0, "aoi": "left", "session": "../x"}', {}, "session"),
    ('{"t": 1.0, "aoi": "left", "session": "**"}', {}, "session"),
    ('{"t": 1.0, "aoi": "left", "source": "a/b"}', {}, "source"),
    ("[" * 100_000, {}, "body"),
    ('{"t": 1.0, "aoi": "moon", "source": "elsewhere"}', {}, "aoi"),
    (json.dumps(GOOD), {"attachment": None}, "attachment"),
    (json.dumps(GOOD), {"attachment": b"\0" * 5}, "attachment"),
    (json.dumps(GOOD), {"attachment": b"\0" * 33}, "gid"),
    (json.dumps(GOOD), {"hash": "RIHS01_" + "0" * 64}, "type hash"),
]


def test_bad_input_is_counted_and_reported_with_field_value_and_rule(mesh: LiveMesh, tmp_path: Path) -> None:
    with Bridge(mesh.zenoh, tmp_path, session="bad", task="grasp", diagnostics_s=0.05) as bridge, wire(bridge) as bad:
        eventually(lambda: bad.call() is not None)
        for text, how, word in BAD_GAZE:
            before = len(bad.diagnostics)
            bad.put("/shift/gaze", text, **how)
            eventually(lambda before=before: len(bad.diagnostics) > before)  # type: ignore[misc]
            last = bad.diagnostics[-1]["last"]
            assert last["topic"] == "gaze", text[:80]
            assert word in json.dumps(last), (text[:80], last)
        for data in (b"", b"\x00\x01", b"\x00\x01\x00\x00\xff\xff\xff\xffab", b"\x00\x01\x00\x00\x03\x00\x00\x00abc",
                     b"\x00\x01\x00\x00\x03\x00\x00\x00\xff\xfe\x00"):  # fmt: skip
            bad.put("/shift/task", data)
        bad.put("/shift/task", '{"task": "a/b"}')
        bad.put("/shift/task_performance", '{"decision_id": "d1"}')
        bad.put(
            "/shift/task_performance", json.dumps({"decision_id": "no", "comprehension": RESULT, "enabledness": RESULT})
        )
        eventually(lambda: bad.dropped("task", "malformed") == 6)
        eventually(lambda: bad.dropped("task_performance", "malformed") == 1)
        eventually(lambda: bad.dropped("task_performance", "unknown") == 1)
        assert bad.dropped("gaze", "malformed") == len(BAD_GAZE)
        answer = bad.call()
        assert answer is not None
        assert answer[0][0] is True
        assert bridge.stop() == 0


def test_requests_of_four_and_five_bytes_are_answered_with_the_attachment(mesh: LiveMesh, tmp_path: Path) -> None:
    with (
        Bridge(mesh.zenoh, tmp_path, session="requests", task="grasp", diagnostics_s=0.05) as bridge,
        wire(bridge) as raw,
    ):
        eventually(lambda: raw.call() is not None)
        for payload in (b"\x00\x01\x00\x00", b"\x00\x01\x00\x00\x00", b"\x00\x01\x00\x00\x00\x00\x00\x00"):
            for written in (TRIGGER.hash, NO_HASH):
                (success, message), attached = raw.call(payload, hash=written)
                assert success
                assert json.loads(message)["task"] == "grasp"
                assert len(attached) == 33
                reply = Attachment.decode(attached)
                assert (reply.sequence, reply.gid) == (raw.sequence, GID)
        assert "cdr" in raw.call(b"\x00\x01")
        assert "attachment" in raw.call(attachment=None)
        assert "type hash" in raw.call(hash="RIHS01_" + "1" * 64)
        attachment = raw.attachment()
        first, again = raw.call(attachment=attachment), raw.call(attachment=attachment)
        assert first[0] == again[0], "the same request is the same decision"
        raw.put("/shift/task", '{"task": "pour", "session": "nobody"}')
        eventually(lambda: json.loads(raw.call()[0][1]).get("kind") == "unknown")
        assert raw.samples
        assert all(len(attached) == 33 for payload, attached in raw.samples if b"{" in payload)


def test_humble_peers_are_heard_and_spoken_to(mesh: LiveMesh, tmp_path: Path) -> None:
    with (
        Bridge(mesh.zenoh, tmp_path, session="humble", distribution="humble") as bridge,
        wire(bridge) as humble,
    ):
        heard: list[str] = []
        subscriber = humble.session.declare_subscriber(
            data_key(0, "/shift/decision", STRING, NO_HASH),
            lambda s: heard.append(cdr.decode_string(s.payload.to_bytes())),
        )
        eventually(lambda: humble.call(hash=NO_HASH) is not None)
        humble.put("/shift/task", '{"task": "grasp"}', hash=NO_HASH)
        eventually(lambda: humble.call(hash=NO_HASH)[0][0])
        eventually(lambda: heard)
        subscriber.undeclare()


def _flood(router: str) -> None:
    """A million messages a minute, for a while; each is put in, whatever it takes."""
    session = zenoh.open(zenoh_config("client", connect=router, timeout_ms=5000))
    publisher = session.declare_publisher(
        data_key(0, "/shift/gaze", STRING, STRING.hash), congestion_control=zenoh.CongestionControl.BLOCK
    )
    attachment = Attachment(1, 1, GID).encode()
    payloads = [cdr.encode_string(json.dumps({"t": i / 17000, "aoi": "left"})) for i in range(FLOOD)]
    begun = time.monotonic()
    for i, payload in enumerate(payloads):
        publisher.put(payload, attachment=attachment)
        if i % 100 == 0:
            time.sleep(max(0.0, begun + i / 17000 - time.monotonic()))
    print(f"flood: {FLOOD / (time.monotonic() - begun):.0f} messages/s")
    session.close()


def _counted(wire: Wire) -> tuple[int, int]:
    """Received and dropped gaze, once the numbers stand still."""
    before, found = (-1, -1), (0, 0)
    until = time.monotonic() + 60.0
    while (before != found or found[0] <= 0) and time.monotonic() < until:
        before = found
        wire.put("/shift/gaze", "{")  # news, so that the counts are told
        time.sleep(2.5)
        told = wire.diagnostics[-1] if wire.diagnostics else {"received": {}, "dropped": {}}
        reasons = told["dropped"].get("gaze", {})
        bad = reasons.get("malformed", 0)
        found = (told["received"].get("gaze", 0) - bad, sum(reasons.values()) - bad)
    return found


def test_a_flood_is_dropped_and_counted_while_requests_are_answered(mesh: LiveMesh, tmp_path: Path) -> None:
    with Bridge(mesh.zenoh, tmp_path, session="flood", task="grasp") as bridge, wire(bridge) as flood:
        eventually(lambda: flood.call() is not None)
        flooding = threading.Thread(target=_flood, args=(bridge.router,))
        flooding.start()
        slowest = 0.0
        while flooding.is_alive():
            asked = time.monotonic()
            assert flood.call() is not None
            slowest = max(slowest, time.monotonic() - asked)
            time.sleep(0.1)
        came, lost = _counted(flood)
        resident = int(Path(f"/proc/{bridge.process.pid}/statm").read_text().split()[1]) * 4096  # type: ignore[union-attr]
        assert came + lost >= FLOOD // 2, "what Zenoh itself drops on a full link nobody can count here"
        print(
            f"flood: {came} of {FLOOD} received, {lost} dropped, slowest request {slowest:.2f} s, {resident >> 20} MB"
        )
        assert resident < 300 << 20
        assert flood.call()[0][0]


@pytest.mark.parametrize(("name", "backend"), [("pyzeros", "native"), ("rclpy", "rclpy")])
def test_killed_in_the_middle_clients_find_it_again_and_nothing_acknowledged_is_lost(
    name: str, backend: str, mesh: LiveMesh, tmp_path: Path
) -> None:
    session = f"killed-{backend}"
    with Bridge(mesh.zenoh, tmp_path, backend, session=session, task="grasp") as bridge, peer(name, bridge) as robot:
        robot.ask("hear", "/shift/decision")
        robot.ask("hear", "/shift/observation")
        robot.ask("service", "/shift/next_strategy")
        robot.ask("advertise", "/shift/task_performance")
        acknowledged: list[dict[str, Any]] = []
        t = 0.0
        for round_ in range(4):
            for _ in range(5):
                for _ in range(10):
                    t += 0.01
                    robot.publish("/shift/gaze", {"t": round(t, 6), "aoi": "left"})
                acknowledged.append(_acknowledged(robot))
                _reported(robot, acknowledged[-1]["decision_id"], len(acknowledged))
            if round_ < 3:
                bridge.kill()
                bridge.start(wait=False)
        found = bridge.log.read_text().count(" started ")
        assert found == 4
    httpx.post(f"{mesh.url}/v1/sessions/{session}/end", timeout=30.0).raise_for_status()
    facts = [f.fact for f in Recording(mesh.data / "recordings" / f"{session}.mcap").facts()]
    decided = [f.decision_id for f in facts if f.subject == "decision"]  # type: ignore[attr-defined]
    reported = [f.decision_id for f in facts if f.subject == "performance"]  # type: ignore[attr-defined]
    assert [d["decision_id"] for d in acknowledged] == [d for d in decided if d in reported] == reported
    assert len(reported) == 20


def _acknowledged(robot: Peer) -> dict[str, Any]:
    """A decision; asked for again while nobody answers, as a robot's program would."""
    until = time.monotonic() + 40.0
    while True:
        answer = robot.ask("call", "/shift/next_strategy", 2.0)
        if answer is not None and answer[0]:
            decision: dict[str, Any] = json.loads(answer[1])
            return decision
        assert time.monotonic() < until, answer
        time.sleep(0.1)


def _reported(robot: Peer, decision_id: str, count: int) -> None:
    """Published again until the observation counts it: the same decision's report is taken once."""
    until = time.monotonic() + 40.0
    while True:
        robot.publish(
            "/shift/task_performance", {"decision_id": decision_id, "comprehension": RESULT, "enabledness": RESULT}
        )
        again = time.monotonic() + 2.0
        while time.monotonic() < again:
            said = robot.said("/shift/observation")
            if said and said[-1]["seen"]["performance"] >= count:
                return
            time.sleep(0.02)
        assert time.monotonic() < until
