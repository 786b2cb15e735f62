"""The contract of every bus: one suite for the in-memory bus and for Zenoh."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable

import pytest
import zenoh
from shift_runtime.bus.protocol import Bus, Incoming, Reply, Request, first_answer
from shift_runtime.bus.zenoh import ZenohBus
from shift_runtime.bus.zenoh_config import zenoh_config
from shift_schemas.errors import InvalidSettings
from support.runtime_fixtures import SOON_S, linked, until, until_asked

pytestmark = pytest.mark.anyio
OpenBus = Callable[[], Awaitable[Bus]]
EVERY_BYTE = bytes(range(256)) * 5


async def pair(open_bus: OpenBus) -> tuple[Bus, Bus]:
    one, other = await open_bus(), await open_bus()
    await linked(one, other)
    return one, other


async def answered(bus: Bus, key: str, count: int) -> None:
    """Wait until ``count`` servers answer under ``key``."""

    async def all_there() -> bool:
        return len(await bus.get(key, timeout_s=SOON_S)) == count

    await until_asked(all_there)


async def test_publication_reaches_every_subscriber_with_its_bytes_and_attachment(open_bus: OpenBus) -> None:
    one, other = await pair(open_bus)
    heard: list[Incoming] = []
    at_home: list[Incoming] = []
    other.subscribe("a/*/c", heard.append)
    one.subscribe("a/*/c", at_home.append)
    await asyncio.sleep(0.1)
    one.put("a/b/c", EVERY_BYTE, encoding="application/json;shift.Marker.v1", attachment=b"17")
    await until(lambda: heard and at_home)
    assert heard == at_home == [Incoming("a/b/c", EVERY_BYTE, b"17")]


async def test_empty_payload_and_missing_attachment_arrive_as_empty_bytes(open_bus: OpenBus) -> None:
    one, other = await pair(open_bus)
    heard: list[Incoming] = []
    other.subscribe("a/b", heard.append)
    await asyncio.sleep(0.1)
    one.put("a/b", b"")
    await until(lambda: heard)
    assert heard == [Incoming("a/b", b"", b"")]


async def test_star_matches_exactly_one_part_of_a_key(open_bus: OpenBus) -> None:
    one, other = await pair(open_bus)
    heard: list[str] = []
    other.subscribe("a/*/c", lambda m: heard.append(m.key))
    other.subscribe("end", lambda m: heard.append(m.key))
    await asyncio.sleep(0.1)
    for key in ("a/1/c", "a/c", "a/1/2/c", "a/1/d", "b/1/c", "a/2/c", "end"):
        one.put(key, b"")
    await until(lambda: "end" in heard)
    assert heard == ["a/1/c", "a/2/c", "end"]


async def test_two_stars_at_the_end_match_any_rest(open_bus: OpenBus) -> None:
    one, other = await pair(open_bus)
    heard: list[str] = []
    other.subscribe("a/**", lambda m: heard.append(m.key))
    await asyncio.sleep(0.1)
    for key in ("b/1", "a/1", "a/1/2/3"):
        one.put(key, b"")
    await until(lambda: len(heard) == 2)
    assert heard == ["a/1", "a/1/2/3"]


async def test_star_matches_no_part_that_begins_with_an_at_sign(open_bus: OpenBus) -> None:
    one, other = await pair(open_bus)
    heard: list[str] = []
    for key in ("a/**", "a/*/c", "a/@b/**", "end"):
        other.subscribe(key, lambda m, key=key: heard.append(f"{key} {m.key}"))
    await asyncio.sleep(0.1)
    for key in ("a/@b/c", "end"):
        one.put(key, b"")
    await until(lambda: "end end" in heard)
    assert heard == ["a/@b/** a/@b/c", "end end"]


async def test_publications_of_one_bus_arrive_in_order(open_bus: OpenBus) -> None:
    one, other = await pair(open_bus)
    heard: list[int] = []
    other.subscribe("n/*", lambda m: heard.append(int(m.payload)))
    await asyncio.sleep(0.1)
    for n in range(500):
        one.put(f"n/{n % 3}", str(n).encode())
    await until(lambda: len(heard) == 500)
    assert heard == list(range(500))


async def test_handlers_run_in_the_loop_one_at_a_time_and_never_within_put(open_bus: OpenBus) -> None:
    bus = await open_bus()
    await linked(bus)
    loop = asyncio.get_running_loop()
    inside: list[bool] = []
    putting = False

    def handle(incoming: Incoming) -> None:
        inside.append(putting)
        assert asyncio.get_running_loop() is loop

    bus.subscribe("a", handle)
    putting = True
    bus.put("a", b"")
    putting = False
    await until(lambda: inside)
    assert inside == [False]


async def test_request_without_a_server_returns_no_replies(open_bus: OpenBus) -> None:
    one, _ = await pair(open_bus)
    assert await one.get("nobody/there", b"?", timeout_s=5.0) == []


async def test_request_and_reply_carry_their_bytes_exactly(open_bus: OpenBus) -> None:
    one, other = await pair(open_bus)
    asked: list[Request] = []

    def echo(request: Request) -> None:
        asked.append(request)
        request.reply(request.payload[::-1])

    other.serve("shift/*/rpc/echo", echo)
    await answered(one, "shift/s1/rpc/echo", 1)
    asked.clear()
    assert await one.get("shift/s1/rpc/echo", EVERY_BYTE, timeout_s=5.0) == [Reply(True, EVERY_BYTE[::-1])]
    assert [(r.key, r.payload) for r in asked] == [("shift/s1/rpc/echo", EVERY_BYTE)]


async def test_server_receives_requests_of_its_own_bus(open_bus: OpenBus) -> None:
    bus = await open_bus()
    bus.serve("own", lambda r: r.reply(b"mine"))
    await answered(bus, "own", 1)
    assert await bus.get("own", timeout_s=5.0) == [Reply(True, b"mine")]


async def test_two_servers_under_one_key_both_reply(open_bus: OpenBus) -> None:
    one, other = await pair(open_bus)
    one.serve("twice", lambda r: r.reply(b"one"))
    other.serve("twice", lambda r: r.refuse(b"other"))
    await answered(one, "twice", 2)
    replies = await one.get("twice", timeout_s=5.0)
    assert {(r.ok, r.payload) for r in replies} == {(True, b"one"), (False, b"other")}


async def test_refusal_is_a_reply_that_is_not_ok(open_bus: OpenBus) -> None:
    one, other = await pair(open_bus)
    other.serve("no", lambda r: r.refuse(b"because"))
    await answered(one, "no", 1)
    assert await one.get("no", timeout_s=5.0) == [Reply(False, b"because")]


async def test_only_the_first_reply_or_refusal_counts(open_bus: OpenBus) -> None:
    one, other = await pair(open_bus)

    def say_twice(request: Request) -> None:
        request.reply(b"first")
        request.refuse(b"second")
        request.reply(b"third")

    other.serve("first", say_twice)
    await answered(one, "first", 1)
    assert await one.get("first", timeout_s=5.0) == [Reply(True, b"first")]


async def test_reply_may_come_later_from_outside_the_handler(open_bus: OpenBus) -> None:
    one, other = await pair(open_bus)
    other.serve("later", lambda r: asyncio.get_running_loop().call_later(0.05, r.reply, b"now"))
    await answered(one, "later", 1)
    assert await one.get("later", timeout_s=5.0) == [Reply(True, b"now")]


async def test_silent_server_gives_no_reply_and_may_still_reply_when_nobody_waits(
    open_bus: OpenBus,
) -> None:
    one, other = await pair(open_bus)
    silent: list[Request] = []
    other.serve("silent", silent.append)
    await until_asked(lambda: _asked(one, silent))
    silent.clear()
    assert await one.get("silent", timeout_s=0.2) == []
    silent[0].reply(b"too late")
    await asyncio.sleep(0.05)


async def _asked(bus: Bus, silent: list[Request]) -> bool:
    await bus.get("silent", timeout_s=0.05)
    return bool(silent)


async def half_silent(open_bus: OpenBus) -> Bus:
    """Return a bus with two servers under ``half``: one replies ``here`` and the other never replies."""
    one, other = await pair(open_bus)
    silent: list[Request] = []
    one.serve("half", silent.append)
    other.serve("half", lambda r: r.reply(b"here"))

    async def both() -> bool:
        silent.clear()
        replies = await one.get("half", timeout_s=0.3)
        return bool(replies and silent)

    await until_asked(both)
    return one


async def test_replies_of_others_count_when_one_server_is_silent(open_bus: OpenBus) -> None:
    one = await half_silent(open_bus)
    assert await one.get("half", timeout_s=0.3) == [Reply(True, b"here")]


async def test_request_ends_with_the_reply_that_is_enough(open_bus: OpenBus) -> None:
    """A silent server is not awaited once another one has answered."""
    one = await half_silent(open_bus)
    loop = asyncio.get_running_loop()
    begun = loop.time()
    assert await one.get("half", timeout_s=60.0, enough=lambda r: r.payload == b"here") == [Reply(True, b"here")]
    assert loop.time() - begun < 30.0  # not a matter of speed: it does not wait for the time to be over


async def test_first_answer_is_the_first_readable_reply(open_bus: OpenBus) -> None:
    one, other = await pair(open_bus)
    one.serve("twice", lambda r: r.reply(b"a stranger's"))
    other.serve("twice", lambda r: asyncio.get_running_loop().call_later(0.05, r.reply, b"7"))
    await answered(one, "twice", 2)

    def number(reply: Reply) -> int | None:
        return int(reply.payload) if reply.payload.isdigit() else None

    assert await first_answer(one, "twice", timeout_s=5.0, read=number) == 7
    assert await first_answer(one, "nobody", timeout_s=5.0, read=number) is None


async def test_arrivals_beyond_the_limit_are_dropped_and_counted(open_bus: OpenBus) -> None:
    one, other = await pair(open_bus)
    heard: list[bytes] = []
    other.subscribe("flood", lambda m: heard.append(m.payload), limit=3)
    other.subscribe("end", lambda m: heard.append(b"end"))
    await asyncio.sleep(0.1)
    for n in range(10):
        one.put("flood", str(n).encode())
    one.put("end", b"")
    _hold_the_loop(0.2)
    await until(lambda: b"end" in heard)
    assert heard == [b"0", b"1", b"2", b"end"]
    assert other.dropped == 7


async def test_flood_of_one_subscriber_loses_nothing_of_another(open_bus: OpenBus) -> None:
    one, other = await pair(open_bus)
    many: list[bytes] = []
    few: list[bytes] = []
    other.subscribe("many", lambda m: many.append(m.payload), limit=1000)
    other.subscribe("few", lambda m: few.append(m.payload), limit=3)
    await asyncio.sleep(0.1)
    for n in range(100):
        one.put("many", str(n).encode())
    for n in range(3):
        one.put("few", str(n).encode())
    _hold_the_loop(0.2)
    await until(lambda: len(many) == 100 and len(few) == 3)
    assert other.dropped == 0


def _hold_the_loop(seconds: float) -> None:
    """While a handler runs, no waiting request is taken."""
    time.sleep(seconds)


async def test_request_beyond_the_limit_is_dropped_and_counted(open_bus: OpenBus) -> None:
    one, other = await pair(open_bus)
    other.serve("busy", lambda r: r.reply(b"yes"), limit=0)
    await until_asked(lambda: _dropped(one, other))
    before = other.dropped
    assert await one.get("busy", timeout_s=0.2) == []
    assert other.dropped == before + 1


async def _dropped(one: Bus, other: Bus) -> bool:
    await one.get("busy", timeout_s=0.05)
    return other.dropped > 0


async def test_closed_handle_receives_nothing_more(open_bus: OpenBus) -> None:
    one, other = await pair(open_bus)
    heard: list[str] = []
    subscribed = other.subscribe("a", lambda m: heard.append(m.key))
    served = other.serve("b", lambda r: r.reply(b"yes"))
    await answered(one, "b", 1)
    for handle in (subscribed, served, subscribed, served):
        handle.close()
    await answered(one, "b", 0)
    one.put("a", b"")
    assert await one.get("b", timeout_s=5.0) == []
    await asyncio.sleep(0.05)
    assert heard == []


async def test_reopened_bus_receives_and_answers_as_before(open_bus: OpenBus) -> None:
    one, other = await pair(open_bus)
    heard: list[bytes] = []
    one.subscribe("shift/v1/s1/marker", lambda incoming: heard.append(incoming.payload))
    taken_back = one.subscribe("shift/v1/s1/marker", lambda incoming: heard.append(b"taken back"))
    one.serve("shift/v1/s1/rpc/mark", lambda request: request.reply(b"yes"))
    taken_back.close()
    for _ in range(2):
        await one.reopen()
        await answered(other, "shift/v1/s1/rpc/mark", 1)
        heard.clear()

        async def arrived() -> bool:
            other.put("shift/v1/s1/marker", b"hello")
            await asyncio.sleep(0.01)
            return bool(heard)

        await until_asked(arrived)
        assert set(heard) == {b"hello"}
        assert one.joined
        assert [reply.payload for reply in await one.get("shift/v1/s1/rpc/mark", timeout_s=1.0)] == [b"yes"]


async def test_owner_is_found_through_the_router_while_it_lives(router: str) -> None:
    owner, asking = await ZenohBus.open(router, "tcp/127.0.0.1:0"), await ZenohBus.open(router, "tcp/127.0.0.1:0")
    key = "shift/v1/@service/monitor/health"
    owner.serve(key, lambda request: request.reply(b"{}"))
    await until_asked(lambda: asking.answers_by_router(key))
    await owner.close()
    assert not await asking.answers_by_router(key)
    await asking.close()


async def test_closed_bus_answers_nothing(open_bus: OpenBus) -> None:
    one, other = await pair(open_bus)
    other.serve("b", lambda r: r.reply(b"yes"))
    other.token("shift/v1/@service/monitor/alive")
    await answered(one, "b", 1)
    await other.close()
    await answered(one, "b", 0)
    await other.close()


async def test_token_lives_as_long_as_its_bus(router: str) -> None:
    key = "shift/v1/@service/learner/alive"
    bus = await ZenohBus.open(router, "tcp/127.0.0.1:0")
    watcher = await asyncio.to_thread(zenoh.open, zenoh_config("client", connect=router))

    def alive() -> bool:
        return any(reply.ok is not None for reply in watcher.liveliness().get(key, timeout=1.0))

    try:
        handle = bus.token(key)
        await until_asked(lambda: asyncio.to_thread(alive))
        handle.close()
        await until_asked(lambda: asyncio.to_thread(lambda: not alive()))
        bus.token(key)
        await until_asked(lambda: asyncio.to_thread(alive))
        await bus.close()
        await until_asked(lambda: asyncio.to_thread(lambda: not alive()))
    finally:
        await bus.close()
        watcher.close()


@pytest.mark.parametrize(
    ("connect", "listen"), [("nonsense", ""), ("tcp/127.0.0.1:1", "nonsense"), ("tcp/127.0.0.1:1", "tcp/nowhere")]
)
async def test_invalid_endpoint_is_an_error_in_the_settings(connect: str, listen: str) -> None:
    with pytest.raises(InvalidSettings, match=r"SHIFT_LISTEN is '.*': ") as found:
        await ZenohBus.open(connect, listen)
    assert ".rs:" not in found.value.detail
