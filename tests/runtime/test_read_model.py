"""The read model: what it knows of a session, what later answers require, and waiting for facts."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from typing import Any

import pytest
from shift_runtime.bus.memory import Hub, MemoryBus
from shift_runtime.read_model import ReadModel, SessionView
from shift_runtime.reader import ReadFact
from shift_schemas.errors import Unavailable
from shift_schemas.messages import Fact, Marker, Seen, Session
from shift_schemas.timestamps import Stamp

pytestmark = pytest.mark.anyio
NOW = Stamp.of(0)
SESSION = Session(session="s1", stamp=NOW, participant="P01", study="x", seed=1, state="live", started=NOW)
MARKER = Marker(session="s1", stamp=NOW, marker_id="m1", text="a note")


@pytest.fixture
async def model() -> AsyncIterator[ReadModel]:
    """Yield a read model that no owner answers."""
    bus = MemoryBus(Hub())
    model = ReadModel([bus], lambda reason: None)
    yield model
    await bus.close()


def delivered(model: ReadModel, seq: int, fact: Fact) -> None:
    """Deliver a fact of the recorder, as the reader would."""
    model.reader.of(fact.session).cursors[fact.session, "recorder"] = seq
    model.reader.of(fact.session).deliver(ReadFact("recorder", seq, fact, fact.model_dump_json()))


def pulled(model: ReadModel, monkeypatch: pytest.MonkeyPatch, then: Any = None) -> list[tuple[str, ...]]:
    """Replace the pulls of owners. Return the list of those that are pulled."""
    pulls: list[tuple[str, ...]] = []

    async def pull_all(owners: tuple[str, ...], session: str | None = None) -> tuple[str, ...]:
        pulls.append(owners)
        if then is not None:
            then()
        return ()

    monkeypatch.setattr(model.reader, "pull_all", pull_all)
    return pulls


async def test_listener_gets_every_fact_even_if_another_one_leaves(model: ReadModel) -> None:
    delivered(model, 1, SESSION)
    view, heard = model.views["s1"], []

    def leaves(fact: Fact, payload: str) -> None:
        view.listeners.remove(leaves)

    view.listeners += [leaves, lambda fact, payload: heard.append((fact.subject, payload))]
    delivered(model, 2, MARKER)
    assert heard == [("marker", MARKER.model_dump_json())]
    assert view.counts == {"session": 1, "marker": 1}


async def test_fact_before_its_session_is_read_again(model: ReadModel) -> None:
    delivered(model, 1, MARKER)
    assert "s1" not in model.views
    assert model.reader.cursor("s1", "recorder") == 0


async def test_wait_ends_with_a_notification(model: ReadModel, monkeypatch: pytest.MonkeyPatch) -> None:
    delivered(model, 1, SESSION)
    pulls = pulled(model, monkeypatch)
    asyncio.get_running_loop().call_later(0.01, lambda: delivered(model, 2, MARKER))
    assert await model.wait("s1", ("recorder",), lambda: model.views["s1"].counts["marker"] == 1, 30.0)
    assert pulls == [], "a notification comes before the first pull"


async def test_wait_without_a_notification_pulls_the_owners(model: ReadModel, monkeypatch: pytest.MonkeyPatch) -> None:
    delivered(model, 1, SESSION)
    pulls = pulled(model, monkeypatch, then=lambda: delivered(model, 2, MARKER))
    assert await model.wait("s1", ("recorder",), lambda: model.views["s1"].counts["marker"] == 1, 30.0)
    assert pulls == [("recorder",)]


async def test_unrelated_facts_do_not_delay_the_pull(model: ReadModel, monkeypatch: pytest.MonkeyPatch) -> None:
    delivered(model, 1, SESSION)
    done = False

    def found() -> None:
        nonlocal done
        done = True

    pulls = pulled(model, monkeypatch, then=found)

    async def talk() -> None:
        while not done:
            delivered(model, 2, MARKER)
            await asyncio.sleep(0.001)

    talking = asyncio.create_task(talk())
    assert await model.wait("s1", ("learner",), lambda: done, 30.0)
    await talking
    assert pulls == [("learner",)]


async def test_wait_ends_at_its_limit(model: ReadModel, monkeypatch: pytest.MonkeyPatch) -> None:
    delivered(model, 1, SESSION)
    pulls = pulled(model, monkeypatch)
    assert not await model.wait("s1", ("recorder",), lambda: False, 0.05)
    assert pulls
    assert not await model.wait("s1", ("recorder",), lambda: False, 0.0)
    assert await model.wait("s1", ("recorder",), lambda: True, 0.0)


async def test_later_answers_require_what_was_answered_and_read() -> None:
    view = SessionView(SESSION)
    assert view.required == Seen(config=1)
    view.n, view.performances = 2, 1
    view.answered.update({"decision": 3, "config": 4})
    assert view.required == Seen(decision=3, performance=1, config=4)
    with pytest.raises(Unavailable, match="has not published a configuration"):
        _ = view.study
