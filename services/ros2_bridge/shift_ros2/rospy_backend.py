"""The rospy backend: an ordinary ROS 1 node. ``rospy`` is imported late, from Debian's packages or a sourced ROS.

rospy registers a node with the master once. A thread of its own therefore waits for a master, looks every second
whether the master still knows the node, and registers it again with a master that was restarted (``ros1_graph``).
Connections between nodes do not go through the master, so they are left as they are.
"""

from __future__ import annotations

import asyncio
import os
import signal
import sys
import threading
from collections.abc import Callable
from concurrent.futures import Future
from concurrent.futures import TimeoutError as NoAnswer
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from xmlrpc.client import Error as XmlRpcError

import structlog
from shift_schemas.errors import InvalidSettings

from shift_ros2.backend import Answer, BackendBase, Handlers, answer_of, unavailable_answer
from shift_ros2.interfaces import INTERFACES, Interface
from shift_ros2.rise import Rise
from shift_ros2.ros1_graph import Registration, register_again, registrations_of, registrations_on
from shift_ros2.settings import BridgeSettings

log = structlog.get_logger()
WATCH_S = 1.0
"""How often the master is asked whether it knows the node. Chosen: a call every second costs a millisecond."""
ANSWER_WITHIN_S = 60.0
"""How long a call may take before it is answered that the bridge is busy. Chosen."""
STOP_S = 3.0
BUFFER = 2**20
"""Bytes that are read at once; rospy's own choice of 64 KB makes a burst of gaze wait."""
DEBIAN = Path("/usr/lib/python3/dist-packages")
"""Where Debian installs rospy, which an environment of our own does not see."""


class RospyBackend(BackendBase):
    """A node in the graph of a ROS 1 master. :meth:`open` makes one."""

    def __init__(self, settings: BridgeSettings, handlers: Handlers, ros: Any) -> None:
        super().__init__(handlers)
        self._settings, self._ros = settings, ros
        self._publishers: dict[str, Any] = {}
        self._service: Any = None
        self._rise: Rise | None = None
        self._joined = False
        self._peers: list[Registration] = []
        """Who publishes and subscribes to the topics of this node."""
        self._state = f"for the ROS master at {settings.master}"
        self._closing = threading.Event()
        self._name = f"{settings.namespace.rstrip('/')}/{settings.node}"

    @classmethod
    async def open(cls, settings: BridgeSettings, handlers: Handlers) -> RospyBackend:
        """Join the graph as soon as there is a master. Raises :class:`InvalidSettings` without rospy."""
        os.environ["ROS_MASTER_URI"], os.environ["ROS_NAMESPACE"] = settings.master, settings.namespace
        backend = cls(settings, handlers, _ros())
        backend._rise = Rise.of(settings)
        threading.Thread(target=backend._watch, name="ros-master", daemon=True).start()
        return backend

    def publish(self, topic: str, text: str) -> None:
        """Publish a text on one of the interfaces."""
        if self._closing.is_set() or not self._joined:
            return
        try:
            self._publishers[topic].publish(self._ros.String(data=text))
            if topic == "decision" and self._rise is not None:
                self._rise.on_decision(text)
        except self._ros.rospy.ROSException as e:
            log.warning("rospy could not publish", topic=topic, error=str(e))

    @property
    def state(self) -> str:
        """That the node waits for the master, or an empty text."""
        return self._state

    async def close(self) -> None:
        """Leave the graph."""
        self._closing.set()
        await self._stop_answers()
        stop = asyncio.to_thread(self._ros.rospy.signal_shutdown, "the bridge stops")
        try:
            await asyncio.wait_for(stop, STOP_S)
        except TimeoutError:
            log.warning("rospy did not stop", after_s=STOP_S)

    # --- in the thread that watches the master ---

    def _watch(self) -> None:
        master = self._ros.rosgraph.Master(self._name, self._settings.master)
        while not self._closing.is_set():
            try:
                master.getPid()
                if not self._joined:
                    self._join()
                elif not self._is_known(master):
                    self._register_again(master)
                else:
                    self._peers = registrations_on(master, self._settings.names.values(), without=self._name)
                self._state = ""
            except (OSError, XmlRpcError, self._ros.rosgraph.MasterException):
                self._state = f"for the ROS master at {self._settings.master}"
            except Exception:  # the watch goes on; the next turn tries again
                log.exception("the ROS master could not be watched")
            self._closing.wait(WATCH_S)

    def _join(self) -> None:
        rospy, settings = self._ros.rospy, self._settings
        rospy.init_node(settings.node, argv=[], disable_signals=True, disable_rostime=True)
        rospy.on_shutdown(self._on_shutdown)
        for interface in INTERFACES:
            self._declare(interface, settings.names[interface.topic])
        if self._rise is not None:
            self._rise.declare(rospy)
        self._joined = True

    def _declare(self, interface: Interface, name: str) -> None:
        rospy, settings = self._ros.rospy, self._settings
        depth = settings.gaze_depth if interface.stream else settings.depth
        match interface.direction:
            case "in":
                take = self._on_message(interface.topic)
                rospy.Subscriber(name, self._ros.String, take, queue_size=depth, buff_size=BUFFER, tcp_nodelay=True)
            case "out":
                self._publishers[interface.topic] = rospy.Publisher(
                    name, self._ros.String, queue_size=depth, tcp_nodelay=True
                )
            case "service":
                self._service = rospy.Service(name, self._ros.Trigger, self._on_request)

    def _is_known(self, master: Any) -> bool:
        try:
            return bool(master.lookupNode(self._name) == self._ros.rospy.get_node_uri())
        except self._ros.rosgraph.MasterError:
            return False

    def _register_again(self, master: Any) -> None:
        """Tell a new master of this node, and of the nodes that talk to it."""
        uri = self._ros.rospy.get_node_uri()
        master.registerService(self._settings.names["next_strategy"], self._service.uri, uri)
        nodes = register_again(self._settings.master, [*registrations_of(self._name, uri), *self._peers])
        log.info("registered again with the ROS master", master=self._settings.master, nodes=nodes)

    def _on_shutdown(self) -> None:
        """Stop the process when another node of the same name replaced this one, as every ROS node does."""
        if not self._closing.is_set():
            log.error("the ROS master asks this node to stop: another node has its name", node=self._name)
            os.kill(os.getpid(), signal.SIGTERM)

    # --- arrivals in rospy's threads, passed on to the loop ---

    def _on_message(self, topic: str) -> Callable[[Any], None]:
        def on_message(message: Any) -> None:
            text = message.data
            self._inbox.put(topic, lambda: self._handle(topic, lambda: self._handlers.on_text(topic, text)))

        return on_message

    def _on_request(self, _request: Any) -> Any:
        answered: Future[Answer] = Future()

        async def answer() -> None:
            answered.set_result(await answer_of(self._handlers, None))

        success, message = unavailable_answer()
        if self._inbox.put("next_strategy", lambda: self._start_answer(answer())):
            try:
                success, message = answered.result(ANSWER_WITHIN_S)
            except NoAnswer:
                log.warning("a request was not answered in time", after_s=ANSWER_WITHIN_S)
        return self._ros.TriggerResponse(success=success, message=message)


def _ros() -> Any:
    """Return the parts of ROS that the backend uses. Raise :class:`InvalidSettings` without ROS."""
    if DEBIAN.is_dir() and str(DEBIAN) not in sys.path:
        sys.path.append(str(DEBIAN))  # behind everything else, so only what is missing is taken from there
    try:
        import rosgraph
        import rospy
        from std_msgs.msg import String
        from std_srvs.srv import Trigger, TriggerResponse
    except ImportError as e:
        raise InvalidSettings(
            f"ROS 1 needs rospy ({e}): on Debian 12, apt install python3-rospy python3-std-msgs python3-std-srvs; "
            "elsewhere, source the setup.bash of a ROS 1 whose Python is this one"
        ) from e
    return SimpleNamespace(
        rospy=rospy, rosgraph=rosgraph, String=String, Trigger=Trigger, TriggerResponse=TriggerResponse
    )
