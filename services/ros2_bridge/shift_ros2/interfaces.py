"""The table of topics and services of the node, by their default names. Both backends declare it. Pure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from shift_ros2.rmw_zenoh import STRING, TRIGGER, RosType

Direction = Literal["in", "out", "service"]
Topic = Literal[
    "gaze", "aois", "task_performance", "task", "next_strategy", "observation", "estimate", "decision", "say",
    "diagnostics",
]  # fmt: skip


@dataclass(frozen=True)
class Interface:
    """One topic or service. ``stream`` says that it has the QoS of the gaze stream."""

    topic: Topic
    direction: Direction
    type: RosType = STRING
    stream: bool = False

    @property
    def name(self) -> str:
        """The name within the namespace, before remapping."""
        return f"shift/{self.topic}"


INTERFACES: tuple[Interface, ...] = (
    Interface("gaze", "in", stream=True),
    Interface("aois", "in", stream=True),
    Interface("task_performance", "in"),
    Interface("task", "in"),
    Interface("next_strategy", "service", TRIGGER),
    Interface("observation", "out"),
    Interface("estimate", "out"),
    Interface("decision", "out"),
    Interface("say", "out"),
    Interface("diagnostics", "out"),
)
PUBLISHED: frozenset[str] = frozenset({"observation", "estimate", "decision"})
"""Facts of the mesh that are published as topics."""
