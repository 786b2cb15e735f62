"""Requests: what is valid is handed over, equal commands are joined, and an earlier result is found."""

from __future__ import annotations

import asyncio
import json
from dataclasses import dataclass, field

import pytest
from shift_runtime.bus.memory import Hub, MemoryBus
from shift_runtime.journal import AnswerKey, StoredAnswer
from shift_runtime.metrics import Metrics
from shift_runtime.service.requests import PendingRequest, Requests
from shift_schemas.codec import encode
from shift_schemas.errors import Conflict, Unavailable
from shift_schemas.messages import GazeChunk
from support.service_parts import Asker, decide, pending

pytestmark = pytest.mark.anyio
CHUNK = GazeChunk(source="eyes", seq=0, t=[0.0], x=[0.5], y=[0.5])
KEY = ("s1", "decide", "d1")


@dataclass
class Answers:
    """Stored answers."""

    stored: dict[AnswerKey, StoredAnswer] = field(default_factory=dict)

    def answer(self, key: AnswerKey) -> StoredAnswer | None:
        return self.stored.get(key)


@dataclass
class Desk:
    """The requests of one service, and what they hand over."""

    service: str
    delivered: list[PendingRequest] = field(default_factory=list)
    joined: bool = False

    def __post_init__(self) -> None:
        hub = Hub()
        self.client, self.answers, self.metrics = MemoryBus(hub), Answers(), Metrics(self.service)
        self.requests = Requests(
            self.service, MemoryBus(hub), self.answers, self.metrics,
            lambda request: self.joined, self.delivered.append,
        )  # fmt: skip
        self.requests.declare()

    async def ask(self, key: str, payload: bytes) -> list[bytes]:
        """Return the payloads of the refusals that came at once."""
        replies = await self.client.get(key, payload, timeout_s=0.02)
        assert not any(reply.ok for reply in replies)
        return [reply.payload for reply in replies]

    @property
    def malformed(self) -> float:
        text = self.metrics.text().decode()
        (line,) = (text for text in text.splitlines() if 'dropped_total{reason="malformed"' in text)
        return float(line.split()[-1])


async def test_valid_command_is_handed_over_with_its_session_and_procedure() -> None:
    desk = Desk("decider")
    await desk.ask("shift/v1/s1/rpc/decide", encode(decide()))
    (request,) = desk.delivered
    assert (request.session, request.procedure, request.message) == ("s1", "decide", decide())
    assert request.key == KEY
    assert len(request.requests) == 1


async def test_command_that_joins_an_equal_one_is_not_handed_over() -> None:
    desk = Desk("decider", joined=True)
    await desk.ask("shift/v1/s1/rpc/decide", encode(decide()))
    assert desk.delivered == []


@pytest.mark.parametrize(
    ("key", "payload"),
    [
        ("shift/v1/s1/rpc/decide", b"{}"),
        ("shift/v1/s1/rpc/decide", b"\xff"),
        ("shift/v1/s1/rpc/decide", encode(decide(session="s2"))),
        ("shift/v1/-x/rpc/decide", encode(decide())),
    ],
)
async def test_malformed_command_is_refused_and_counted(key: str, payload: bytes) -> None:
    desk = Desk("decider")
    (refusal,) = await desk.ask(key, payload)
    assert json.loads(refusal)["kind"] == "malformed"
    assert desk.delivered == []
    assert desk.malformed == 1


async def test_service_receives_its_own_procedures_only() -> None:
    desk = Desk("learner")
    assert await desk.ask("shift/v1/s1/rpc/decide", encode(decide())) == []
    assert desk.delivered == []


async def test_chunk_is_handed_over_from_a_request_and_from_a_publication() -> None:
    desk = Desk("monitor")
    await desk.ask("shift/v1/s1/in/gaze", encode(CHUNK))
    desk.client.put("shift/v1/s1/in/gaze", encode(CHUNK))
    await asyncio.sleep(0)
    assert [(r.session, r.procedure, r.message, r.key) for r in desk.delivered] == [("s1", "gaze", CHUNK, None)] * 2
    assert [len(r.requests) for r in desk.delivered] == [1, 0]


async def test_malformed_chunk_is_counted_and_refused_where_somebody_asks() -> None:
    desk = Desk("monitor")
    (refusal,) = await desk.ask("shift/v1/s1/in/gaze", b"[]")
    desk.client.put("shift/v1/s1/in/gaze", b"[]")
    await asyncio.sleep(0)
    assert json.loads(refusal)["kind"] == "malformed"
    assert desk.malformed == 2
    assert desk.delivered == []


async def test_result_of_an_equal_command_is_found_committed_or_not() -> None:
    desk = Desk("decider")
    stored = StoredAnswer(decide().content(), '{"n":1}')
    assert desk.requests.earlier_result(pending(), {}) is None
    assert desk.requests.earlier_result(pending(), {KEY: stored}) == '{"n":1}'
    desk.answers.stored[KEY] = stored
    assert desk.requests.earlier_result(pending(), {}) == '{"n":1}'
    assert desk.requests.earlier_result(pending("d2"), {}) is None


async def test_same_id_with_another_content_is_a_conflict() -> None:
    desk = Desk("decider")
    desk.answers.stored[KEY] = StoredAnswer(decide().content(), '{"n":1}')
    with pytest.raises(Conflict, match="decision d1 was made before, with task any; this request says task other"):
        desk.requests.earlier_result(pending("d1", "other"), {})


async def test_chunk_has_no_stored_result() -> None:
    assert Desk("monitor").requests.earlier_result(PendingRequest("s1", "gaze", CHUNK, []), {}) is None


def test_everybody_who_waits_gets_the_reply() -> None:
    askers = [Asker(), Asker()]
    pending("d1", "any", *askers).reply(b"done")
    assert [asker.replies for asker in askers] == [[b"done"]] * 2


def test_everybody_who_waits_is_refused_once() -> None:
    askers = [Asker(), Asker()]
    request = pending("d1", "any", *askers)
    for _ in range(2):
        request.refuse(Unavailable("the disk is full"))
    assert [len(asker.refusals) for asker in askers] == [1, 1]
    assert json.loads(askers[0].refusals[0])["detail"] == "the disk is full"
