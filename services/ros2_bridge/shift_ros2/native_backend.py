"""The native backend: the protocol of ``rmw_zenoh`` on a Zenoh session of our own. No ROS needed here.

The session is another than the mesh's and meets the ROS nodes at their router. Callbacks run in Zenoh's
thread, copy the bytes and hand over; everything is read in the loop.
"""

from __future__ import annotations

import asyncio
import json
import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from itertools import count
from typing import Any

import zenoh
from shift_runtime.bus.zenoh import direct
from shift_runtime.bus.zenoh_config import zenoh_config
from shift_schemas.errors import InvalidSettings, MalformedMessage, Problem, ShiftError, shorten

from shift_ros2 import cdr, ros4hri
from shift_ros2.backend import Handlers, Inbox, answer_of, stopped
from shift_ros2.interfaces import INTERFACES, Interface
from shift_ros2.rmw_zenoh import Attachment, Node, RosType, data_key, gid_of, hash_of, qos_text
from shift_ros2.ros4hri import ENGAGEMENT, ENGAGEMENT_LEVEL, IDS_LIST, TRACKED
from shift_ros2.settings import BridgeSettings

OVERRIDE = "ZENOH_CONFIG_OVERRIDE"
"""As ``rmw_zenoh`` reads it: ``path=value;path=value``, values in JSON."""
ENCODING = zenoh.Encoding.APPLICATION_CDR


@dataclass
class _Publisher:
    """A declared publisher, with what its attachments need."""

    publisher: zenoh.Publisher
    gid: bytes
    sequence: int = 0

    def put(self, payload: bytes) -> None:
        self.sequence += 1
        attachment = Attachment(self.sequence, time.time_ns(), self.gid).encode()
        self.publisher.put(payload, attachment=attachment)


class NativeBackend:
    """See the module. Make it by :meth:`open`."""

    def __init__(self, session: zenoh.Session, settings: BridgeSettings, handlers: Handlers) -> None:
        self._session = session
        self._settings = settings
        self._handlers = handlers
        self._names = settings.names
        self._inbox = Inbox(self._overflowed)
        self._node = Node(settings.domain, str(session.zid()), 0, settings.namespace, settings.node)
        self._entities = count(1)
        self._publishers: dict[str, _Publisher] = {}
        self._declared: list[Any] = []
        self._answering: set[asyncio.Task[None]] = set()

    @classmethod
    async def open(cls, settings: BridgeSettings, handlers: Handlers) -> NativeBackend:
        """Join the graph. A router that is not there yet is tried again in the background."""
        config = ros_config(settings)
        try:
            session = await asyncio.to_thread(zenoh.open, config)
        except zenoh.ZError as e:
            raise InvalidSettings(f"the Zenoh session to ROS cannot be opened: {e}") from e
        backend = cls(session, settings, handlers)
        backend._declare()
        return backend

    def publish(self, topic: str, text: str) -> None:
        """See :class:`~shift_ros2.backend.Backend`."""
        if topic in self._publishers:  # after close there are none
            self._publishers[topic].put(cdr.encode_string(text))

    @property
    def state(self) -> str:
        """See :class:`~shift_ros2.backend.Backend`."""
        met = list(self._session.info.routers_zid())
        return "" if met else f"for a Zenoh router for ROS at {self._settings.ros_router}"

    async def close(self) -> None:
        """See :class:`~shift_ros2.backend.Backend`."""
        await stopped(self._answering.copy())
        self._publishers.clear()
        for thing in reversed(self._declared):
            thing.undeclare()
        self._declared.clear()
        await asyncio.to_thread(self._session.close)

    # --- declarations ---

    def _declare(self) -> None:
        """The data first, the tokens after it: who sees us can reach us."""
        for interface in INTERFACES:
            match interface.direction:
                case "in":
                    self._subscribe(interface)
                case "out":
                    self._advertise(interface)
                case "service":
                    self._serve(interface)
        if self._settings.ros4hri:
            self._listen(TRACKED, IDS_LIST, self._on_tracked)
            self._listen(ENGAGEMENT, ENGAGEMENT_LEVEL, self._on_engagement)
        self._token(self._node.token())

    def _subscribe(self, interface: Interface) -> None:
        topic, name = interface.topic, self._names[interface.topic]

        def on_sample(sample: zenoh.Sample) -> None:
            key, payload, attachment = _copied(sample)
            self._inbox.put(topic, lambda: self._take_text(topic, interface.type, key, payload, attachment))

        key = data_key(self._settings.domain, name, interface.type, "*")
        self._declared.append(self._session.declare_subscriber(key, direct(on_sample)))
        self._token(self._entity("MS", interface))

    def _advertise(self, interface: Interface) -> None:
        written = interface.type.hash_in(self._settings.distribution)
        key = data_key(self._settings.domain, self._names[interface.topic], interface.type, written)
        publisher = self._session.declare_publisher(
            key, encoding=ENCODING, congestion_control=zenoh.CongestionControl.DROP,
            # a link that observations fill lets a decision through
            priority=zenoh.Priority.DATA_HIGH if interface.topic == "decision" else zenoh.Priority.DATA,
        )  # fmt: skip
        token = self._entity("MP", interface)
        self._declared.append(publisher)
        self._publishers[interface.topic] = _Publisher(publisher, gid_of(token))
        self._token(token)

    def _serve(self, interface: Interface) -> None:
        topic, name = interface.topic, self._names[interface.topic]

        def on_query(query: zenoh.Query) -> None:
            if not self._inbox.put(topic, lambda: self._take_request(interface, query)):
                query.drop()  # type: ignore[no-untyped-call]

        key = data_key(self._settings.domain, name, interface.type, "*")
        queryable = self._session.declare_queryable(key, direct(on_query), complete=True)
        self._declared.append(queryable)
        self._token(self._entity("SS", interface))

    def _listen(self, name: str, kind: RosType, take: Callable[[str, bytes], None]) -> None:
        """Hear a topic of other packages, where somebody publishes it."""

        def on_sample(sample: zenoh.Sample) -> None:
            key, payload, _ = _copied(sample)
            self._inbox.put(name, lambda: self._guarded(name, lambda: take(key, payload)))

        key = data_key(self._settings.domain, name, kind, "*")
        self._declared.append(self._session.declare_subscriber(key, direct(on_sample)))

    def _entity(self, kind: Any, interface: Interface) -> str:
        settings = self._settings
        reliable = (settings.gaze_reliability if interface.stream else settings.reliability) == "reliable"
        qos = qos_text(reliable or kind == "SS", settings.gaze_depth if interface.stream else settings.depth)
        name, written = self._names[interface.topic], interface.type.hash_in(settings.distribution)
        return self._node.entity_token(next(self._entities), kind, name, interface.type, written, qos)

    def _token(self, key: str) -> None:
        self._declared.append(self._session.liveliness().declare_token(key))

    # --- arrivals; all in the loop ---

    def _take_text(self, topic: str, kind: RosType, key: str, payload: bytes, attachment: bytes | None) -> None:
        def take() -> None:
            self._check(kind, key)
            _attachment_of(attachment)
            self._handlers.on_text(topic, cdr.decode_string(payload))

        self._guarded(topic, take)

    def _take_request(self, interface: Interface, query: zenoh.Query) -> None:
        try:
            self._check(interface.type, str(query.key_expr))
            attachment = _attachment_of(query.attachment.to_bytes() if query.attachment else None)
            cdr.check_trigger_request(query.payload.to_bytes() if query.payload else b"")
        except MalformedMessage as e:
            self._handlers.on_lost(interface.topic, e)
            query.reply_err(Problem.of(e).model_dump_json())
            query.drop()  # type: ignore[no-untyped-call]
            return
        task = asyncio.get_running_loop().create_task(self._answer(query, attachment))
        self._answering.add(task)
        task.add_done_callback(self._answering.discard)

    async def _answer(self, query: zenoh.Query, attachment: Attachment) -> None:
        try:
            success, message = await answer_of(self._handlers, attachment.name())
            reply = Attachment(attachment.sequence, time.time_ns(), attachment.gid).encode()
            payload = cdr.encode_trigger_response(success, message)
            query.reply(query.key_expr, payload, encoding=ENCODING, attachment=reply)
        finally:
            query.drop()  # type: ignore[no-untyped-call]

    def _on_tracked(self, key: str, payload: bytes) -> None:
        self._handlers.on_tracked(ros4hri.tracked_of(payload))

    def _on_engagement(self, key: str, payload: bytes) -> None:
        self._handlers.on_engagement(ros4hri.person_of(key.partition("/")[2]), ros4hri.level_of(payload))

    def _guarded(self, topic: str, take: Callable[[], None]) -> None:
        try:
            take()
        except ShiftError as e:
            self._handlers.on_lost(topic, e)

    def _check(self, kind: RosType, key: str) -> None:
        written = hash_of(key)
        if not kind.fits(written):
            raise MalformedMessage(f"type hash {shorten(written)}: {kind.name} is {kind.hash}")

    def _overflowed(self, topic: str, number: int) -> None:
        error = ShiftError("messages came faster than the bridge could read them; some were dropped")
        self._handlers.on_lost(topic, error, number, reason="overload")


def ros_config(settings: BridgeSettings) -> zenoh.Config:
    """As ``rmw_zenoh`` opens its sessions; without a listener as a client, whose router passes everything on."""
    mode = "peer" if settings.ros_listen else "client"
    try:
        config = zenoh_config(mode, connect=settings.ros_router, listen=settings.ros_listen)
        for entry in filter(None, os.environ.get(OVERRIDE, "").split(";")):
            path, _, value = entry.partition("=")
            config.insert_json5(path.strip(), value.strip() or json.dumps(None))
    except zenoh.ZError as e:
        raise InvalidSettings(f"ros_router {settings.ros_router} or {OVERRIDE} is not valid: {e}") from e
    return config


def _copied(sample: zenoh.Sample) -> tuple[str, bytes, bytes | None]:
    return str(sample.key_expr), sample.payload.to_bytes(), sample.attachment.to_bytes() if sample.attachment else None


def _attachment_of(data: bytes | None) -> Attachment:
    if data is None:
        raise MalformedMessage("attachment: it is missing: rmw_zenoh sends 33 bytes with each sample and request")
    return Attachment.decode(data)
