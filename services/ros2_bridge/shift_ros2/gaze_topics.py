"""Topics of a ROS 2 graph that may carry gaze, by their name or type, from the liveliness tokens of rmw_zenoh."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

PUBLISHER = "MP"
TOKENS = "@ros2_lv/**"
WAIT_S = 1.0


class GazeTopic(NamedTuple):
    """A topic that somebody publishes."""

    name: str
    type: str


def gaze_topics(tokens: Iterable[str]) -> list[GazeTopic]:
    """Return the published topics with ``gaze`` in their name or type. Pure; other tokens are left out."""
    found = set()
    for token in tokens:
        parts = token.split("/")
        if len(parts) != 13 or parts[5] != PUBLISHER:
            continue
        topic = GazeTopic(parts[9].replace("%", "/"), _type_of(parts[10]))
        if "gaze" in f"{topic.name} {topic.type}".lower():
            found.add(topic)
    return sorted(found)


def find_gaze_topics(router: str) -> list[GazeTopic]:
    """Return the gaze topics in the graph of the rmw_zenoh router at this endpoint; none without such a router."""
    import zenoh
    from shift_runtime.bus.zenoh_config import zenoh_config

    try:
        config = zenoh_config("client", connect=router)
        config.insert_json5("connect/timeout_ms", "1000")
        with zenoh.open(config) as session:
            replies = session.liveliness().get(TOKENS, timeout=WAIT_S)
            return gaze_topics(str(reply.ok.key_expr) for reply in replies if reply.ok is not None)
    except zenoh.ZError:
        return []


def _type_of(dds: str) -> str:
    """Return ``hri_msgs/msg/Gaze`` for ``hri_msgs::msg::dds_::Gaze_``."""
    package, _, rest = dds.replace("dds_::", "").partition("::")
    return f"{package}/{rest.removesuffix('_').replace('::', '/')}"
