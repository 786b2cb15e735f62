"""The bus over Zenoh.

Peer mode with explicit endpoints and gossip: processes meet at the router and then link directly, so that a router's
failure affects new processes only. There is no multicast, because it does not cross a bridge network.

Callbacks run in Zenoh's own threads (``indirect=False``), copy the bytes and pass them to the loop. Measured
(docs/design.md): 122 us per request that way, 365 us with the default callback.
"""

from __future__ import annotations

import asyncio
import contextlib
import ctypes
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

import zenoh
from shift_schemas.errors import InvalidSettings
from shift_schemas.shards import every_shard
from zenoh.handlers import Callback

from shift_runtime.bus.protocol import Handle, Incoming, Reply, Request
from shift_runtime.bus.zenoh_config import zenoh_config

T = TypeVar("T")
CLOSE_WITHIN_S = 2.0
"""How long a close is awaited. Peers that leave at the same moment can delay it for ten seconds, without effect."""

BY_ROUTER_S = 1.0
"""How long an owner that does not answer directly may take to answer through the router."""

NO_REPLY = (b"", b"Timeout")
"""The payloads that Zenoh itself sends in place of a reply that did not come in time."""
_attached = threading.local()


def direct(handle: Callable[[T], None], drop: Callable[[], None] | None = None) -> Callback[T]:
    """Return ``handle`` as a callback that runs in Zenoh's own thread, which keeps its Python thread state.

    Otherwise CPython makes and destroys a thread state for each call. Measured: 14 us of 217 us per request, and 50 us
    of 733 us where the processes had slept for 30 ms. One ``PyGILState_Ensure`` without a release keeps the state.
    """

    def run(item: T) -> None:
        if not hasattr(_attached, "done"):
            ctypes.pythonapi.PyGILState_Ensure()
            _attached.done = True
        handle(item)

    return Callback(run, drop, indirect=False)


@dataclass
class _Lane:
    """One handler, and how many of its items wait."""

    handle: Callable[[Any], None]
    limit: int
    waiting: int = 0


class _Gate:
    """Passes items from Zenoh's threads to the loop. A burst wakes the loop once; the order of all items is kept.

    While as many items of a handler wait as its ``limit``, further ones are dropped and counted.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._lock = threading.Lock()
        self._items: list[tuple[_Lane, Any]] = []
        self.dropped = 0

    def handler(self, handle: Callable[[T], None], limit: int) -> Callable[[T], None]:
        lane = _Lane(handle, limit)

        def enqueue(item: T) -> None:
            with self._lock:
                if lane.waiting >= lane.limit:
                    self.dropped += 1
                    return
                lane.waiting += 1
                self._items.append((lane, item))
                if len(self._items) > 1:
                    return  # the loop is woken already
            with contextlib.suppress(RuntimeError):  # the loop is closed: the process is ending
                self._loop.call_soon_threadsafe(self._hand_over)

        return enqueue

    def _hand_over(self) -> None:
        with self._lock:
            items, self._items = self._items, []
            for lane, _ in items:
                lane.waiting -= 1
        for lane, item in items:
            try:
                lane.handle(item)
            except Exception as e:  # the items behind it are handled all the same
                self._loop.call_exception_handler({"message": "a handler of messages failed", "exception": e})


@dataclass
class _Request:
    key: str
    payload: bytes
    query: zenoh.Query | None

    def reply(self, payload: bytes) -> None:
        if self.query is not None:
            with contextlib.suppress(zenoh.ZError):  # its session was closed meanwhile: the sender repeats the request
                self.query.reply(self.key, payload)
            self._done()

    def refuse(self, payload: bytes) -> None:
        if self.query is not None:
            with contextlib.suppress(zenoh.ZError):
                self.query.reply_err(payload)
            self._done()

    def _done(self) -> None:
        if self.query is not None:
            self.query.drop()  # type: ignore[no-untyped-call]
            self.query = None


@dataclass
class _Handle:
    """A declaration, and how to make it on another session."""

    declare: Callable[[zenoh.Session], Any]
    thing: Any

    def close(self) -> None:
        if self.thing is not None:
            self.thing.undeclare()
            self.thing = None

    def move(self, session: zenoh.Session) -> None:
        if self.thing is not None:
            self.thing = self.declare(session)


class _Replies:
    """The replies to one request, passed from Zenoh's threads to the loop until the last one or one that is enough."""

    def __init__(self, loop: asyncio.AbstractEventLoop, enough: Callable[[Reply], bool] | None) -> None:
        self._loop = loop
        self._enough = enough
        self._replies: list[Reply] = []
        self._done: asyncio.Future[None] = loop.create_future()

    async def all(self, timeout_s: float) -> list[Reply]:
        """Return the replies once the request has ended, after ``timeout_s`` at the latest."""
        limit = self._loop.call_later(timeout_s, self._end)
        try:
            await self._done
        finally:
            limit.cancel()
        return self._replies

    def on_reply(self, reply: zenoh.Reply) -> None:
        """Receive a reply, in a thread of Zenoh's."""
        if reply.ok is not None:
            self._pass_on(self._take, Reply(True, reply.ok.payload.to_bytes()))
        elif reply.err is not None and (said := reply.err.payload.to_bytes()) not in NO_REPLY:
            self._pass_on(self._take, Reply(False, said))

    def on_end(self) -> None:
        """Receive the end of the replies, in a thread of Zenoh's."""
        self._pass_on(self._end)

    def _pass_on(self, handle: Callable[..., None], *arguments: Reply) -> None:
        if not self._done.done():  # replies after the last one wake nobody
            with contextlib.suppress(RuntimeError):  # the loop is closed: the process is ending
                self._loop.call_soon_threadsafe(handle, *arguments)

    def _take(self, reply: Reply) -> None:
        if not self._done.done():
            self._replies.append(reply)
            if self._enough is not None and self._enough(reply):
                self._done.set_result(None)

    def _end(self) -> None:
        if not self._done.done():
            self._done.set_result(None)


class ZenohBus:
    """One Zenoh session. Create it with :meth:`open` in the loop in which its handlers run."""

    def __init__(
        self,
        session: zenoh.Session,
        loop: asyncio.AbstractEventLoop,
        connect: str = "",
        listen: str = "",
        namespace: str = "",
    ) -> None:
        self.session = session
        self._connect, self._listen, self._namespace = connect, listen, namespace
        self._moving = asyncio.Lock()
        self._loop = loop
        self._gate = _Gate(loop)
        self._handles: list[_Handle] = []

    @classmethod
    async def open(cls, connect: str, listen: str = "", namespace: str = "") -> ZenohBus:
        """Open a session. A router that does not run yet is tried again in the background.

        Every key of the session is under ``namespace``, if one is given, as each shard of a mesh has one.

        Raises
        ------
        InvalidSettings
            An endpoint is not valid, or it cannot be listened on.
        """
        try:
            session = await _opened(connect, listen, namespace)
        except zenoh.ZError as e:
            said = str(e).partition(" at /")[0]
            raise InvalidSettings(f"SHIFT_ZENOH is {connect!r}, SHIFT_LISTEN is {listen!r}: {said}") from e
        return cls(session, asyncio.get_running_loop(), connect, listen, namespace)

    def put(self, key: str, payload: bytes, *, encoding: str = "", attachment: bytes = b"") -> None:
        """See :class:`~shift_runtime.bus.protocol.Bus`."""
        self.session.put(
            key,
            payload,
            encoding=encoding or None,
            attachment=attachment or None,
            congestion_control=zenoh.CongestionControl.DROP,
        )

    async def get(
        self, key: str, payload: bytes = b"", *, timeout_s: float, enough: Callable[[Reply], bool] | None = None
    ) -> list[Reply]:
        """See :class:`~shift_runtime.bus.protocol.Bus`."""
        replies = _Replies(self._loop, enough)
        self.session.get(
            key,
            direct(replies.on_reply, replies.on_end),
            payload=payload or None,
            timeout=timeout_s,
            target=zenoh.QueryTarget.ALL,
            consolidation=zenoh.ConsolidationMode.NONE,
        )
        return await replies.all(timeout_s + 0.5)

    def subscribe(self, key: str, handler: Callable[[Incoming], None], *, limit: int = 10_000) -> Handle:
        """See :class:`~shift_runtime.bus.protocol.Bus`."""
        enqueue = self._gate.handler(handler, limit)

        def on_sample(sample: zenoh.Sample) -> None:
            attachment = sample.attachment
            enqueue(
                Incoming(str(sample.key_expr), sample.payload.to_bytes(), attachment.to_bytes() if attachment else b"")
            )

        return self._held(lambda session: session.declare_subscriber(key, direct(on_sample)))

    def serve(self, key: str, handler: Callable[[Request], None], *, limit: int = 10_000) -> Handle:
        """See :class:`~shift_runtime.bus.protocol.Bus`."""
        enqueue = self._gate.handler(handler, limit)

        def on_query(query: zenoh.Query) -> None:
            payload = query.payload
            enqueue(_Request(str(query.key_expr), payload.to_bytes() if payload else b"", query))

        return self._held(lambda session: session.declare_queryable(key, direct(on_query)))

    def token(self, key: str) -> Handle:
        """See :class:`~shift_runtime.bus.protocol.Bus`."""
        return self._held(lambda session: session.liveliness().declare_token(key))

    async def reopen(self) -> None:
        """See :class:`~shift_runtime.bus.protocol.Bus`. The new session is open before the old one closes."""
        async with self._moving:
            try:
                session = await _opened(self._connect, self._listen, self._namespace)
                for handle in self._handles:
                    handle.move(session)
            except zenoh.ZError as e:
                raise InvalidSettings(f"SHIFT_ZENOH is {self._connect!r}, SHIFT_LISTEN is {self._listen!r}: {e}") from e
            left, self.session = self.session, session
            _leave(left, lambda: None)

    async def answers_by_router(self, key: str) -> bool:
        """See :class:`~shift_runtime.bus.protocol.Bus`. It asks as a client, which has no other link."""
        return await asyncio.to_thread(_answers, self._connect, self._namespace, key)

    @property
    def joined(self) -> bool:
        """See :class:`~shift_runtime.bus.protocol.Bus`."""
        return bool(self.session.info.routers_zid() or self.session.info.peers_zid())

    @property
    def dropped(self) -> int:
        """See :class:`~shift_runtime.bus.protocol.Bus`."""
        return self._gate.dropped

    async def close(self) -> None:
        """See :class:`~shift_runtime.bus.protocol.Bus`. An open session would block the process at its exit."""
        for handle in self._handles:
            with contextlib.suppress(zenoh.ZError):
                handle.close()
        self._handles.clear()
        closed = asyncio.Event()

        def done() -> None:
            with contextlib.suppress(RuntimeError):  # the loop did not wait
                self._loop.call_soon_threadsafe(closed.set)

        _leave(self.session, done)
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(closed.wait(), CLOSE_WITHIN_S)

    def _held(self, declare: Callable[[zenoh.Session], Any]) -> Handle:
        handle = _Handle(declare, declare(self.session))
        self._handles.append(handle)
        return handle


async def open_buses(connect: str, listen: str, shards: int) -> list[ZenohBus]:
    """Open the bus of each shard, in their order. Raise :class:`InvalidSettings` if an endpoint is not valid."""
    return [await ZenohBus.open(connect, listen, shard.name) for shard in every_shard(shards)]


async def _opened(connect: str, listen: str, namespace: str) -> zenoh.Session:
    mode = "peer" if listen else "client"
    config = zenoh_config(mode, connect=connect, listen=listen, namespace=namespace)
    return await asyncio.to_thread(zenoh.open, config)


def _leave(session: zenoh.Session, then: Callable[[], None]) -> None:
    """Close a session in its own thread: peers that leave at the same moment can delay it for ten seconds."""

    def close() -> None:
        with contextlib.suppress(zenoh.ZError):  # "timed out": a peer left at the same moment
            session.close()  # type: ignore[no-untyped-call]
        then()

    threading.Thread(target=close, name="zenoh-close", daemon=True).start()


def _answers(connect: str, namespace: str, key: str) -> bool:
    config = zenoh_config("client", connect=connect, timeout_ms=round(1000 * BY_ROUTER_S), namespace=namespace)
    try:
        session = zenoh.open(config)
    except zenoh.ZError:
        return False
    try:
        return any(reply.ok is not None for reply in session.get(key, timeout=BY_ROUTER_S))
    except zenoh.ZError:
        return False
    finally:
        _leave(session, lambda: None)
