"""The histories of open pages, and the room view computed from them, in a mesh on the in-memory bus."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest
from shift_gateway.gateway import Gateway
from shift_gateway.settings import GatewaySettings
from shift_gateway.web.charts import strip_marks, strip_points
from shift_gateway.web.live_histories import LiveHistories
from shift_gateway.web.room_view import room_view
from shift_runtime.bus.memory import MemoryBus
from shift_schemas.errors import UnknownThing
from shift_schemas.timestamps import NS
from support.gateway_mesh import HANG_LIMIT_S, NEGATED, PLAIN, STUDY, Mesh, Session

pytestmark = pytest.mark.anyio


@asynccontextmanager
async def following(mesh: Mesh) -> AsyncIterator[tuple[Gateway, LiveHistories]]:
    """Run a second gateway on the mesh, whose histories the test opens."""
    gateway = Gateway(GatewaySettings(data=mesh.data))
    async with gateway.on([MemoryBus(mesh.hub)], mesh.clock):
        yield gateway, LiveHistories(gateway)


async def interactions(session: Session, count: int) -> list[str]:
    """Decide and report ``count`` times; return the decisions' ids."""
    ids = []
    for _ in range(count):
        await session.look(["cup"] * 4)
        ids.append((await session.decide())["decision_id"])
        await session.report(ids[-1])
    return ids


async def test_history_opened_in_the_middle_of_a_session_has_all_of_it(own_mesh: Mesh) -> None:
    async with following(own_mesh) as (_, histories):
        session = await own_mesh.session(STUDY)
        ids = await interactions(session, 3)
        await session.done("markers", {"text": "a note"})
        history = await histories.open(session.name)
        assert [d.decision_id for d in history.decisions.until()] == ids
        ids += await interactions(session, 2)
        async with asyncio.timeout(HANG_LIMIT_S):
            while len(history.performances) < 5:  # noqa: ASYNC110 - a history has no event
                await asyncio.sleep(0.005)
        assert [d.decision_id for d in history.decisions.until()] == ids
        assert [d.n for d in history.decisions.until()] == [1, 2, 3, 4, 5]
        assert [m.text for m in history.markers.until()] == ["a note"]
        assert len({o.payload for o in history.observations.until()}) == len(history.observations)


async def test_session_that_ended_before_the_gateway_started_has_all_of_it(own_mesh: Mesh) -> None:
    session = await own_mesh.session(STUDY)
    ids = await interactions(session, 2)
    await session.end()
    async with following(own_mesh) as (_, histories):
        history = await histories.open(session.name)
        assert [d.decision_id for d in history.decisions.until()] == ids
        assert len(history.performances) == 2
        assert history.observation() is not None


async def test_nothing_is_kept_once_the_last_page_is_closed(own_mesh: Mesh) -> None:
    async with following(own_mesh) as (gateway, histories):
        session = await own_mesh.session(STUDY)
        first, second = await histories.open(session.name), await histories.open(session.name)
        assert first is second
        listeners = gateway.read_model.views[session.name].listeners
        assert len(listeners) == 1
        histories.close(session.name)
        assert len(listeners) == 1
        histories.close(session.name)
        assert not listeners
        assert await histories.open(session.name) is not first


async def test_unknown_session_is_refused_and_leaves_nothing(own_mesh: Mesh) -> None:
    async with following(own_mesh) as (_, histories):
        with pytest.raises(UnknownThing, match="there is no session nobody"):
            await histories.open("nobody")
        session = await own_mesh.session(STUDY)
        assert (await histories.open(session.name)).session() is not None


async def test_room_view_shows_the_last_decision_and_the_missing_result(own_mesh: Mesh) -> None:
    async with following(own_mesh) as (_, histories):
        session = await own_mesh.session(STUDY)
        await session.look(["cup"] * 8)
        await session.done("override", {"task": "turn", "strategy": NEGATED})
        history = await histories.open(session.name)
        now = own_mesh.clock.now().ns
        async with asyncio.timeout(HANG_LIMIT_S):
            while not room_view(history, now).overrides:  # noqa: ASYNC110 - a history has no event
                await asyncio.sleep(0.005)
        before = room_view(history, now)
        assert (before.decision_number, before.say, before.overrides) == (
            "0", "no decision yet", {"turn": "negation"}
        )  # fmt: skip
        decision = await session.decide("turn")
        async with asyncio.timeout(HANG_LIMIT_S):
            while not len(history.decisions):  # noqa: ASYNC110 - a history has no event
                await asyncio.sleep(0.005)
        view = room_view(history, now + 9 * NS)
        assert (view.say, view.strategy, view.origin) == ("negation", "negation, none", "override")
        assert (view.cognitive_state, view.task) == (decision["cognitive_state"], "turn")
        assert view.result_pending.startswith("RESULT MISSING ")
        assert view.overrides == {}
        assert view.sources["ros"].source == "ros"
        assert view.looked_at == ()


async def test_room_view_says_the_text_of_the_decision_and_the_strategy_where_there_is_none(own_mesh: Mesh) -> None:
    async with following(own_mesh) as (_, histories):
        session = await own_mesh.session({**STUDY, "phrases": {"sentences": {"affirmation": "take it."}}})
        history = await histories.open(session.name)
        for strategy, say in ((PLAIN, "Take it."), (NEGATED, "negation")):
            await session.done("override", {"task": "grasp", "strategy": strategy})
            await session.decide()
            async with asyncio.timeout(HANG_LIMIT_S):
                while room_view(history, 10 * NS).say != say:  # noqa: ASYNC110 - a history has no event
                    await asyncio.sleep(0.01)


async def test_room_view_of_an_earlier_time_shows_what_held_then(own_mesh: Mesh) -> None:
    async with following(own_mesh) as (_, histories):
        session = await own_mesh.session(STUDY)
        await interactions(session, 1)
        middle = own_mesh.clock.now().ns + NS
        own_mesh.clock.ns += 10 * NS
        await interactions(session, 2)
        history = await histories.open(session.name)
        view = room_view(history, middle, middle)
        assert view.decision_number == "1"
        assert room_view(history, middle + 20 * NS).decision_number == "3"
        assert strip_points(history, 0, middle)
        assert [n for _, n in strip_marks(history, middle)["decisions"]] == ["1"]
