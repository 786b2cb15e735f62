"""The rclpy backend: an ordinary ROS node over the RMW that is installed. ``rclpy`` is imported late.

The bridge's settings resolve names, parameters and remaps, so that both backends take the same command line. One
thread spins and passes on what arrives; answers are sent from the loop, so that gaze is received meanwhile. rclpy
would poll coroutines without a pause, so none are used.
"""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import structlog
from shift_schemas.errors import InvalidSettings

from shift_ros2.backend import Answer, BackendBase, Handlers, answer_of, unavailable_answer
from shift_ros2.interfaces import INTERFACES, Interface
from shift_ros2.ros4hri import TRACKED
from shift_ros2.say_skill import SaySkill, say_skill_of
from shift_ros2.settings import BridgeSettings

log = structlog.get_logger()
PAUSE_S = 0.1
STOP_S = 5.0


class RclpyBackend(BackendBase):
    """A node in the ROS graph made by rclpy. :meth:`open` makes one."""

    def __init__(self, settings: BridgeSettings, handlers: Handlers, ros: Any) -> None:
        self._settings = settings
        super().__init__(handlers)
        self._ros = ros
        self._publishers: dict[str, Any] = {}
        self._engagements: set[str] = set()
        self._say_skill: SaySkill | None = None
        self._closing = False

    @classmethod
    async def open(cls, settings: BridgeSettings, handlers: Handlers) -> RclpyBackend:
        """Join the graph. Raises :class:`InvalidSettings` without ROS."""
        backend = cls(settings, handlers, _ros())
        backend._start()
        return backend

    def publish(self, topic: str, text: str) -> None:
        """Publish a text on one of the interfaces."""
        if self._closing:
            return
        self._publishers[topic].publish(self._ros.String(data=text))
        if topic == "say" and self._say_skill is not None:
            self._say_skill.say(text)

    @property
    def state(self) -> str:
        """Always empty: a ROS graph has no place to wait for."""
        return ""

    async def close(self) -> None:
        """Leave the graph."""
        self._closing = True
        await self._stop_answers()
        await asyncio.to_thread(self._stop)

    # --- life ---

    def _start(self) -> None:
        ros, settings = self._ros, self._settings
        self._context = ros.Context()
        ros.rclpy.init(
            args=[], context=self._context, domain_id=settings.domain,
            signal_handler_options=ros.SignalHandlerOptions.NO,
        )  # fmt: skip
        self._node = ros.rclpy.create_node(
            settings.node, namespace=settings.namespace, context=self._context, use_global_arguments=False,
            start_parameter_services=False,
        )  # fmt: skip
        for interface in INTERFACES:
            self._declare(interface, settings.names[interface.topic])
        if settings.ros4hri:
            self._declare_ros4hri()
        if settings.say_skill:
            self._say_skill = say_skill_of(self._node, settings.say_skill)
        self._executor = ros.Executor(context=self._context)
        self._executor.add_node(self._node)
        self._thread = threading.Thread(target=self._spin, name="rclpy", daemon=True)
        self._thread.start()

    def _spin(self) -> None:
        while not self._closing and self._context.ok():
            try:
                self._executor.spin_once(0.5)
            except self._ros.ExternalShutdownException:
                return
            except Exception:  # a message that rclpy cannot read must not cost the others
                log.exception("rclpy failed")
                time.sleep(PAUSE_S)

    def _stop(self) -> None:
        self._executor.shutdown(STOP_S)
        self._thread.join(STOP_S)
        self._node.destroy_node()
        self._ros.rclpy.try_shutdown(context=self._context)

    def _declare(self, interface: Interface, name: str) -> None:
        match interface.direction:
            case "in":
                take = self._on_message(interface.topic)
                self._node.create_subscription(self._ros.String, name, take, self._qos(interface))
            case "out":
                self._publishers[interface.topic] = self._node.create_publisher(
                    self._ros.String, name, self._qos(interface)
                )
            case "service":
                self._serve(name)

    def _qos(self, interface: Interface) -> Any:
        settings = self._settings
        word = settings.gaze_reliability if interface.stream else settings.reliability
        policy = self._ros.ReliabilityPolicy
        return self._ros.QoSProfile(
            depth=settings.gaze_depth if interface.stream else settings.depth,
            reliability=policy.RELIABLE if word == "reliable" else policy.BEST_EFFORT,
        )

    # --- arrivals in rclpy's thread, passed on to the loop ---

    def _on_message(self, topic: str) -> Callable[[Any], None]:
        def on_message(message: Any) -> None:
            text = message.data
            self._inbox.put(topic, lambda: self._handle(topic, lambda: self._handlers.on_text(topic, text)))

        return on_message

    def _serve(self, name: str) -> None:
        """Take requests without waiting for their answers, which are sent from the loop.

        rclpy sends what the callback returns, and the answer is not known then. So the service's ``send_response``
        is replaced by a function that keeps the request's header for later.
        """
        service = self._node.create_service(self._ros.Trigger, name, lambda _, response: response)
        self._send = service.send_response
        service.send_response = self._on_request

    def _on_request(self, response: Any, header: Any) -> None:
        if not self._inbox.put("next_strategy", lambda: self._ask(response, header)):
            self._reply(response, header, unavailable_answer())

    # --- in the loop ---

    def _ask(self, response: Any, header: Any) -> None:
        async def answer() -> None:
            self._reply(response, header, await answer_of(self._handlers, None))

        self._start_answer(answer())

    def _reply(self, response: Any, header: Any, answer: Answer) -> None:
        response.success, response.message = answer
        self._send(response, header)

    # --- ROS4HRI, if hri_msgs is installed ---

    def _declare_ros4hri(self) -> None:
        try:
            from hri_msgs.msg import EngagementLevel, IdsList
        except ImportError:
            return

        def on_tracked(message: Any) -> None:
            ids = [str(i) for i in message.ids][:256]
            self._inbox.put(TRACKED, lambda: self._handle(TRACKED, lambda: self._handlers.on_tracked(ids)))
            for person in ids:
                if person not in self._engagements and len(self._engagements) < 256:
                    self._engagements.add(person)
                    name = f"/humans/persons/{person}/engagement_status"
                    self._node.create_subscription(EngagementLevel, name, on_engagement(person), 10)

        def on_engagement(person: str) -> Callable[[Any], None]:
            def on_level(message: Any) -> None:
                take = partial(self._handlers.on_engagement, person, int(message.level))
                self._inbox.put(TRACKED, lambda: self._handle(TRACKED, take))

            return on_level

        self._node.create_subscription(IdsList, TRACKED, on_tracked, 10)


def _ros() -> Any:
    """Return the parts of ROS that the backend uses. Raise :class:`InvalidSettings` without ROS."""
    try:
        import rclpy
        from rclpy.context import Context
        from rclpy.executors import ExternalShutdownException
        from rclpy.qos import QoSProfile, ReliabilityPolicy
        from rclpy.signals import SignalHandlerOptions
        from std_msgs.msg import String
        from std_srvs.srv import Trigger
    except ImportError as e:
        raise InvalidSettings(
            f"backend rclpy needs ROS 2 ({e}): source its setup.bash, or pip install shift-mesh[ros2], "
            "or take backend native with RMW_IMPLEMENTATION=rmw_zenoh_cpp in the other nodes"
        ) from e
    from types import SimpleNamespace

    return SimpleNamespace(
        rclpy=rclpy, Context=Context, ExternalShutdownException=ExternalShutdownException,
        Executor=_executor(), QoSProfile=QoSProfile, ReliabilityPolicy=ReliabilityPolicy,
        SignalHandlerOptions=SignalHandlerOptions, String=String, Trigger=Trigger,
    )  # fmt: skip


def _executor() -> Any:
    """Return the executor without a wait set if rclpy has it (from Jazzy on): a call is 0.5 ms shorter."""
    try:
        from rclpy.experimental import EventsExecutor
    except ImportError:
        from rclpy.executors import SingleThreadedExecutor

        return SingleThreadedExecutor
    return EventsExecutor
