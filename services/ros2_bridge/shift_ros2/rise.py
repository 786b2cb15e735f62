"""RISE, the scenario manager of the paper's group: each decision goes into its memory, and raises an event there.

RISE takes goals of its action ``DomainTaskAction`` (docs/rise.md). Its source was not to be had, so the definition of
the action is in a file, ``DomainTask.action``, which a lab can replace: ROS compares checksums of definitions.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from shift_schemas.errors import InvalidSettings

from shift_ros2.settings import BridgeSettings

PACKAGE = "ros_tcp_endpoint"
TYPE = f"{PACKAGE}/DomainTaskActionGoal"
DEFINITION = Path(__file__).with_name("DomainTask.action")
EVENT = "shift_decision"
MEMORY_KEY = "shift"
FIELDS = ("session", "decision_id", "n", "task", "strategy", "cognitive_state", "text")
"""What a decision has in RISE's memory."""
NEEDED = frozenset({"domain_task_behavior", "function_type", "calling_type"})
LINE = "=" * 80
Function = Literal["assignValue", "raiseEventTopic"]


@dataclass(frozen=True)
class Goal:
    """A goal of ``DomainTaskAction``, without its header."""

    id: str
    behavior: str
    function: Function


def goals_of(decision: dict[str, Any], memory: bool, event: bool) -> Iterator[Goal]:
    """Yield the goals of a decision: first the value in the memory, then the event that a rule waits for. Pure."""
    name = f"shift-{decision['decision_id']}"
    if memory:
        value = {MEMORY_KEY: {field: decision[field] for field in FIELDS if decision.get(field) is not None}}
        yield Goal(f"{name}-memory", json.dumps(value, ensure_ascii=False), "assignValue")
    if event:
        yield Goal(f"{name}-event", EVENT, "raiseEventTopic")


def definition_of(action: str) -> str:
    """Return the message definition of the action's goal, with the types that it is made of. Pure.

    Raises
    ------
    InvalidSettings
        The text does not have the three parts of an action: goal, result and feedback, divided by ``---``.
    """
    parts = re.split(r"^---\s*$", action, flags=re.MULTILINE)
    if len(parts) != 3:
        raise InvalidSettings(f"a ROS action has three parts, divided by lines with ---; this file has {len(parts)}")
    goal = "\n".join(line.split("#")[0].rstrip() for line in parts[0].splitlines() if line.split("#")[0].strip())
    return f"\n{LINE}\n".join(
        (
            f"Header header\nactionlib_msgs/GoalID goal_id\n{PACKAGE}/DomainTaskGoal goal",
            "MSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id",
            "MSG: actionlib_msgs/GoalID\ntime stamp\nstring id",
            f"MSG: {PACKAGE}/DomainTaskGoal\n{goal}",
        )
    )


def message_type_of(action: str) -> Any:
    """Return the ROS message class of the action's goal, made from the definition.

    Raises
    ------
    InvalidSettings
        The definition is not valid, or its goal lacks a field of RISE's documentation.
    """
    from genmsg import InvalidMsgSpec, MsgGenerationException, MsgNotFound
    from genpy.dynamic import generate_dynamic

    try:
        kind = generate_dynamic(TYPE, definition_of(action))[TYPE]
        missing = sorted(NEEDED - set(type(kind().goal).__slots__))
    except (InvalidMsgSpec, MsgGenerationException, MsgNotFound, KeyError) as e:
        raise InvalidSettings(f"its goal is not a ROS message: {e}") from e
    if missing:
        raise InvalidSettings(f"its goal has no field {missing[0]}, which RISE's documentation names")
    return kind


class Rise:
    """Sends goals to RISE."""

    def __init__(self, settings: BridgeSettings, kind: Any) -> None:
        self._settings, self._kind = settings, kind
        self._publisher: Any = None
        self._newest: list[Goal] = []

    @classmethod
    def of(cls, settings: BridgeSettings) -> Rise | None:
        """Return what the settings ask for. Raises :class:`InvalidSettings` for a definition that is not valid."""
        if not (settings.rise_memory or settings.rise_event):
            return None
        path = Path(settings.rise_action or DEFINITION)
        try:
            return cls(settings, message_type_of(path.read_text(encoding="utf-8")))
        except (OSError, UnicodeDecodeError) as e:
            raise InvalidSettings(f"the action definition {path} cannot be read: {e}") from e
        except InvalidSettings as e:
            raise InvalidSettings(f"the action definition {path}: {e.detail}") from e

    def declare(self, rospy: Any) -> None:
        """Advertise the goals."""
        self._rospy = rospy
        listener = rospy.SubscribeListener()
        listener.peer_subscribe = self._on_subscribed
        self._publisher = rospy.Publisher(
            self._settings.rise_goal, self._kind, queue_size=self._settings.depth, tcp_nodelay=True,
            subscriber_listener=listener,
        )  # fmt: skip

    def on_decision(self, text: str) -> None:
        """Send the goals of a decision."""
        settings = self._settings
        goals = list(goals_of(json.loads(text), settings.rise_memory, settings.rise_event))
        connected = self._publisher.get_num_connections() > 0
        for goal in goals:
            self._publisher.publish(self._message(goal))
        # an event that was raised is over; a value stays, so that a RISE that starts again gets it
        self._newest = [goal for goal in goals if goal.function == "assignValue" or not connected]

    def _on_subscribed(self, _topic: str, _publish: Any, publish_to_peer: Any) -> None:
        """Send the newest goals again, with their ids, to a RISE that connects after them."""
        newest, self._newest = self._newest, [goal for goal in self._newest if goal.function == "assignValue"]
        for goal in newest:
            publish_to_peer(self._message(goal))

    def _message(self, goal: Goal) -> Any:
        message = self._kind()
        message.header.stamp = message.goal_id.stamp = self._rospy.Time.now()
        message.goal_id.id = goal.id
        message.goal.domain_task_behavior = goal.behavior
        message.goal.function_type = goal.function
        message.goal.calling_type = "None"
        return message
