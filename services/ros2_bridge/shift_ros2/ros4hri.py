"""ROS4HRI (REP-155): the tracked persons and their engagement become markers in the recording. Pure.

``hri_msgs`` does not belong to the common messages of ROS: the native backend decodes its CDR, and the rclpy backend
needs the package. ``hri_msgs/msg/Gaze`` names persons (sender, receiver) and not objects, so that it cannot serve as
gaze on AOIs and is not read.
"""

from __future__ import annotations

from shift_schemas.errors import MalformedMessage, shorten

from shift_ros2.cdr import CdrReader
from shift_ros2.rmw_zenoh import RosType

TRACKED = "/humans/persons/tracked"
ENGAGEMENT = "/humans/persons/*/engagement_status"
IDS_LIST = RosType("hri_msgs/msg/IdsList", "")
ENGAGEMENT_LEVEL = RosType("hri_msgs/msg/EngagementLevel", "")
LEVELS = ("unknown", "disengaged", "engaging", "engaged", "disengaging")
"""The constants of ``hri_msgs/msg/EngagementLevel``, 0 to 4."""
PERSONS = 256


def tracked_of(data: bytes) -> list[str]:
    """Return the ids of a ``hri_msgs/msg/IdsList``."""
    reader = _after_header(data)
    return reader.strings()


def level_of(data: bytes) -> int:
    """Return the level of a ``hri_msgs/msg/EngagementLevel``."""
    return _after_header(data).uint8()


def person_of(topic: str) -> str:
    """Return the person whose engagement a topic carries."""
    return topic.strip("/").split("/")[2]


class Persons:
    """Remembers the last values, so that a marker is written only for a change and not thirty times a second."""

    def __init__(self) -> None:
        self._tracked: list[str] | None = None
        self._levels: dict[str, int] = {}

    def tracked(self, ids: list[str]) -> str | None:
        """Return the text of the marker; None if the same persons are tracked as before."""
        now = sorted(map(shorten, ids))[:PERSONS]
        if now == self._tracked:
            return None
        self._tracked = now
        self._levels = {p: level for p, level in self._levels.items() if p in now}
        return f"ROS4HRI tracked: {', '.join(now) or 'nobody'}"

    def engagement(self, person: str, level: int) -> str | None:
        """Return the text of the marker; None if the person's level is unchanged. Raise :class:`MalformedMessage`."""
        if not 0 <= level < len(LEVELS):
            raise MalformedMessage(f"engagement_status: level {level}: it must be 0 to {len(LEVELS) - 1}")
        if self._levels.get(person) == level or (person not in self._levels and len(self._levels) >= PERSONS):
            return None
        self._levels[person] = level
        return f"ROS4HRI engagement of {shorten(person)}: {LEVELS[level]}"


def _after_header(data: bytes) -> CdrReader:
    """Return a reader after the std_msgs/msg/Header: a stamp (two numbers) and a frame."""
    reader = CdrReader(data)
    reader.uint32()
    reader.uint32()
    reader.string()
    return reader
