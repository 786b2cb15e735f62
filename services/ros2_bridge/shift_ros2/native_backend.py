"""The native backend: the protocol of ``rmw_zenoh`` on a Zenoh session. It needs no ROS.

This session is not the mesh's: it meets the ROS nodes at their router. Callbacks run in Zenoh's thread and copy the
bytes; the bridge's loop decodes them.
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
from shift_schemas.errors import InvalidSettings, MalformedMessage, Problem, shorten

from shift_ros2 import cdr, ros4hri
from shift_ros2.backend import BackendBase, Handlers, answer_of
from shift_ros2.interfaces import INTERFACES, Interface
from shift_ros2.rmw_zenoh import Attachment, Node, RosType, data_key, gid_of, hash_of, qos_text
from shift_ros2.ros4hri import ENGAGEMENT, ENGAGEMENT_LEVEL, IDS_LIST, TRACKED
from shift_ros2.settings import BridgeSettings

OVERRIDE = "ZENOH_CONFIG_OVERRIDE"
"""``rmw_zenoh`` reads it too: ``path=value;path=value``, with values in JSON."""
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


class NativeBackend(BackendBase):
    """A node in the ROS graph over a Zenoh session. :meth:`open` makes one."""

    def __init__(self, session: zenoh.Session, settings: BridgeSettings, handlers: Handlers) -> None:
        self._session = session
        self._settings = settings
        super().__init__(handlers)
        self._names = settings.names
        self._node = Node(settings.domain, str(session.zid()), 0, settings.namespace, settings.node)
        self._entities = count(1)
        self._publishers: dict[str, _Publisher] = {}
        self._declared: list[Any] = []

    @classmethod
    async def open(cls, settings: BridgeSettings, handlers: Handlers) -> NativeBackend:
        """Join the graph. Zenoh retries a router that does not answer yet in the background."""
        config = ros_config(settings)
        try:
            session = await asyncio.to_thread(zenoh.open, config)
        except zenoh.ZError as e:
            raise InvalidSettings(f"the Zenoh session to ROS cannot be opened: {e}") from e
        backend = cls(session, settings, handlers)
        backend._declare()
        return backend

    def publish(self, topic: str, text: str) -> None:
        """Publish a text on one of the interfaces."""
        if topic in self._publishers:  # there are none after close
            self._publishers[topic].put(cdr.encode_string(text))

    @property
    def state(self) -> str:
        """What the backend waits for, or an empty text."""
        met = list(self._session.info.routers_zid())
        return "" if met else f"for a Zenoh router for ROS at {self._settings.ros_router}"

    async def close(self) -> None:
        """Leave the graph."""
        await self._stop_answers()
        self._publishers.clear()
        for thing in reversed(self._declared):
            thing.undeclare()
        self._declared.clear()
        await asyncio.to_thread(self._session.close)

    # --- declarations ---

    def _declare(self) -> None:
        """Declare the data before the tokens, so that every peer that sees the node can reach it."""
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
            # a decision passes observations that fill a link
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
        """Subscribe to a topic of another package."""

        def on_sample(sample: zenoh.Sample) -> None:
            key, payload, _ = _copied(sample)
            self._inbox.put(name, lambda: self._handle(name, lambda: take(key, payload)))

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

    # --- arrivals, in the loop ---

    def _take_text(self, topic: str, kind: RosType, key: str, payload: bytes, attachment: bytes | None) -> None:
        def take() -> None:
            self._check(kind, key)
            _attachment_of(attachment)
            self._handlers.on_text(topic, cdr.decode_string(payload))

        self._handle(topic, take)

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
        self._start_answer(self._answer(query, attachment))

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

    def _check(self, kind: RosType, key: str) -> None:
        written = hash_of(key)
        if not kind.fits(written):
            raise MalformedMessage(f"type hash {shorten(written)}: {kind.name} is {kind.hash}")


def ros_config(settings: BridgeSettings) -> zenoh.Config:
    """Return the configuration that ``rmw_zenoh`` uses; without a listener, the session is a client of its router."""
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
