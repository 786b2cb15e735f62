"""A stranger's Zenoh session puts nonsense on every kind of key while a session runs: counted and dropped."""

from __future__ import annotations

import itertools
import json
import random
import threading
import time
from collections.abc import Iterator

import httpx
import pytest
import zenoh
from prometheus_client.parser import text_string_to_metric_families
from shift_runtime.bus.zenoh_config import zenoh_config
from shift_schemas.keys import ENDPOINTS
from shift_schemas.registry import PROCEDURE_OWNER, SUBJECTS
from support.interactions import check_recording, essences, expected, interact
from support.whole_mesh import LiveMesh

SERVICES = ("recorder", "monitor", "decider", "learner")
SESSION = "haunted"
ANOTHER = "somebody-else"
HOSTILE = ("**", "*", "$*", f"{SESSION}$*", "..", "-x", "a b", "ü", "x" * 64, "x" * 4000, "@service", "%2e%2e", "\x7f")
STAMP = {"sec": 1, "nsec": 0}
RANDOM = random.Random(7)


def payloads() -> dict[str, bytes]:
    """Return payloads that are not a valid message under any key."""
    start = {"participant": "P", "study": "default", "seed": 1, "state": "live", "started": STAMP}
    marker = {"session": SESSION, "stamp": STAMP, "marker_id": "m", "text": "note", "surprise": 1}
    elsewhere = {"session": ANOTHER, "stamp": STAMP, **start}
    chunk = {"source": "eyes", "seq": 0, "t": [0.0], "aoi": ["left"]}
    return {
        "empty": b"",
        "null": b"null",
        "number": b"7",
        "list": b"[]",
        "object": b"{}",
        "random": RANDOM.randbytes(300),
        "half a character": b'{"session": "\\ud800"}',
        "not UTF-8": b'{"session": "\xff"}',
        "NaN": json.dumps({**chunk, "t": [float("nan")]}).encode(),
        "infinite": b'{"source": "eyes", "seq": 1e999, "t": [1e999], "aoi": [null]}',
        "wrong types": json.dumps({"session": 1, "stamp": "now", "t": "0", "seq": True}).encode(),
        "booleans": json.dumps({**chunk, "seq": True}).encode(),
        "unequal columns": json.dumps({**chunk, "aoi": []}).encode(),
        "wrong session": json.dumps(elsewhere).encode(),
        "unknown field": json.dumps(marker).encode(),
        "a health": b'{"service": "monitor", "ready": false}',
        "a megabyte": b'{"text": "' + b"x" * 2**20 + b'"}',
        "deep": b'{"a": ' * 20_000,
        "deep and closed": b"[" * 50_000 + b"]" * 50_000,
        "a page": b'{"owner": "monitor", "rows": [], "heads": {}, "complete": true}',
        "hostile cursors": b'{"cursors": {"**": 1}}',
    }


def keys() -> dict[str, tuple[str, ...]]:
    """Return every kind of key, with valid and invalid parts."""
    return {
        "facts": tuple(f"shift/v1/{SESSION}/{subject}" for subject in SUBJECTS),
        "gaze": (f"shift/v1/{SESSION}/in/gaze",),
        "commands": tuple(f"shift/v1/{SESSION}/rpc/{procedure}" for procedure in PROCEDURE_OWNER),
        "doors": tuple(f"shift/v1/@service/{s}/{door}" for s in (*SERVICES, "gateway") for door in ENDPOINTS),
        "wild": ("shift/v1/*/decision", "shift/v1/**", "shift/v1/*/in/*", "shift/v1/*/rpc/*", "shift/v1/@service/*/*"),
        "hostile": tuple(f"shift/v1/{h}/{rest}" for h in HOSTILE for rest in ("decision", "in/gaze", "rpc/decide")),
        "none of ours": ("shift/v1", f"shift/v1/{SESSION}", f"shift/v1/{SESSION}/in/sound", "shift/v1/a/b/c/d/e"),
    }


ATTACHMENTS = (b"", b"1", b"0", b"-3", b"one", b"999999999999999", b"9" * 400, b"\xff", b"replay:x")
ATTACHMENTS += tuple(str(n).encode() for n in range(2, 400, 7))  # the next one, by chance


class Stranger(threading.Thread):
    """Goes through all of it, again and again, until told to stop; every put and every get at least once."""

    def __init__(self, endpoint: str) -> None:
        super().__init__(daemon=True)
        self.session = zenoh.open(zenoh_config("client", connect=endpoint))
        self.enough = threading.Event()
        self.rounds = 0
        self.error: BaseException | None = None
        self.answered_ok: list[str] = []

    def run(self) -> None:
        try:
            while not self.enough.is_set() or not self.rounds:
                self.one_round()
                self.rounds += 1
        except BaseException as e:
            self.error = e
        finally:
            self.session.close()

    def one_round(self) -> None:
        attachments = itertools.cycle(ATTACHMENTS)
        for name, payload in payloads().items():
            large = len(payload) > 2**19
            for kind, found in keys().items():
                for key in found[:1] if large else found:
                    self.put(key, payload, next(attachments))
                if kind in ("commands", "gaze", "doors") and not large:
                    for key in found:
                        self.get(name, key, payload)
            if self.enough.wait(0.01) and self.rounds:
                return

    def put(self, key: str, payload: bytes, attachment: bytes) -> None:
        try:
            self.session.put(key, payload, attachment=attachment or None)
        except zenoh.ZError:  # a key that Zenoh itself does not take
            return

    def get(self, name: str, key: str, payload: bytes) -> None:
        """Send a request without waiting, as an attacker would, and keep who answered it as if it were valid."""

        def heard(reply: zenoh.Reply) -> None:
            if reply.ok is not None and "/rpc/" in key:
                self.answered_ok.append(f"{key} {name}")

        self.session.get(key, heard, payload=payload, timeout=0.5, target=zenoh.QueryTarget.ALL)


def dropped(mesh: LiveMesh) -> dict[str, float]:
    """Return for each service the malformed messages in ``shift_messages_dropped_total``."""
    text = httpx.get(f"{mesh.url}/metrics", timeout=10.0).text
    return {
        sample.labels["service"]: sample.value
        for family in text_string_to_metric_families(text)
        for sample in family.samples
        if sample.name == "shift_messages_dropped_total" and sample.labels["reason"] == "malformed"
    }


@pytest.fixture
def stranger(mesh: LiveMesh) -> Iterator[Stranger]:
    found = Stranger(mesh.zenoh)
    found.start()
    yield found
    found.enough.set()
    found.join(60)


def test_nonsense_on_every_key_is_counted_and_dropped_and_the_session_is_exact(
    mesh: LiveMesh, stranger: Stranger
) -> None:
    pids = {s: mesh.pid_of(f"shift_{s}") for s in (*SERVICES, "gateway", "runtime.router")}
    before = dropped(mesh)
    done = interact(mesh, SESSION, 7, after=lambda n: None)
    stranger.enough.set()
    stranger.join(60)
    assert stranger.error is None
    assert stranger.rounds >= 1
    assert essences(done) == expected(7)
    check_recording(mesh, done)
    assert stranger.answered_ok == []
    after = dropped(mesh)
    assert all(after[s] > before[s] for s in (*SERVICES, "gateway")), (before, after)
    assert {s: mesh.pid_of(f"shift_{s}") for s in pids} == pids
    assert sorted(s["session"] for s in httpx.get(f"{mesh.url}/v1/sessions").json()["sessions"]) == [SESSION]
    mesh.wait_ready()


KINDS = {
    "a fact without a sequence": (f"shift/v1/{SESSION}/decision", b"{}", b"", ("monitor", "learner", "gateway")),
    "a fact that is none": (f"shift/v1/{SESSION}/observation", b"{}", b"1", ("decider", "recorder", "gateway")),
    "gaze": (f"shift/v1/{SESSION}/in/gaze", b"{}", b"", ("monitor",)),
    "a command, published": (f"shift/v1/{SESSION}/rpc/decide", b"{}", b"", ("recorder",)),
    "a service's door, published": ("shift/v1/@service/monitor/outbox", b"{}", b"", ("recorder",)),
    "no key of ours": (f"shift/v1/{SESSION}/in/sound", b"{}", b"", ("recorder",)),
    "a wildcard": ("shift/v1/*/decision", b"{}", b"1", ("monitor", "learner", "recorder", "gateway")),
    "a hostile id": ("shift/v1/-x/in/gaze", b"{}", b"", ("monitor",)),
}


@pytest.mark.parametrize(("key", "payload", "attachment", "services"), KINDS.values(), ids=KINDS)
def test_each_kind_of_nonsense_is_counted_where_it_arrives(
    mesh: LiveMesh, key: str, payload: bytes, attachment: bytes, services: tuple[str, ...]
) -> None:
    before = dropped(mesh)
    session = zenoh.open(zenoh_config("client", connect=mesh.zenoh))
    try:
        for _ in range(5):
            session.put(key, payload, attachment=attachment or None)
        mesh.until(lambda: all(dropped(mesh)[s] >= before[s] + 5 for s in services))
    finally:
        session.close()


@pytest.mark.parametrize("procedure", PROCEDURE_OWNER)
def test_nonsense_as_any_command_is_counted_and_refused(mesh: LiveMesh, procedure: str) -> None:
    owner = PROCEDURE_OWNER[procedure]
    before = dropped(mesh)[owner]
    session = zenoh.open(zenoh_config("client", connect=mesh.zenoh))
    try:
        for payload in (b"", b"{}", b"\xff", b'{"command_id": "x", "session": "somebody-else"}'):
            (reply,) = session.get(f"shift/v1/{SESSION}/rpc/{procedure}", payload=payload, timeout=5.0)
            assert reply.err is not None
            assert json.loads(reply.err.payload.to_bytes())["kind"] == "malformed"
    finally:
        session.close()
    mesh.until(lambda: dropped(mesh)[owner] >= before + 4)


def test_well_formed_facts_of_a_session_to_come_take_no_place_in_it(mesh: LiveMesh) -> None:
    """A stranger is first with sequence 1 and 2 of every owner; the owners' own are read all the same."""
    session = zenoh.open(zenoh_config("client", connect=mesh.zenoh))
    whose = {"session": "to-come", "stamp": STAMP}
    fixation = {**whose, "source": "eyes", "start_s": 0.0, "duration_s": 0.1, "x": 0.5, "y": 0.5, "aoi": ""}
    override = {**whose, "override_id": "o1", "task": "task-1", "strategy": {}, "reason": ""}
    marker = {**whose, "marker_id": "m1", "text": ""}
    try:
        for sequence in (b"1", b"2"):
            for subject, fact in (("fixation", fixation), ("override", override), ("marker", marker)):
                session.put(f"shift/v1/to-come/{subject}", json.dumps(fact).encode(), attachment=sequence)
        time.sleep(0.3)
    finally:
        session.close()
    done = interact(mesh, "to-come", 7, 10)
    assert essences(done) == expected(7, 10)
    messages = check_recording(mesh, done)
    assert not {"fixation", "override", "marker"} & set(messages)
