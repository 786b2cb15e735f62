"""zenoh-ros2-sdk as a peer: another independent implementation of rmw_zenoh."""

import sys
import time

from peer_base import PeerBase, drive
from zenoh_ros2_sdk import ROS2Publisher, ROS2ServiceClient, ROS2Subscriber

STRING = "string data\n"
# Given, since the SDK would fetch definitions from GitHub; the hash is ROS's own.
TRIGGER_HASH = "RIHS01_eeff2cd6fa5ad9d27cdf4dec64818317839b62f212a91e6b5304b634b2062c5f"
HEADER = (
    "\n" + "=" * 80 + "\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
    + "=" * 80 + "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
)  # fmt: skip
HRI = {
    "hri_msgs/msg/IdsList": "std_msgs/Header header\nstring[] ids\n" + HEADER,
    "hri_msgs/msg/EngagementLevel": "std_msgs/Header header\nuint8 level\n" + HEADER,
}
"""ROS4HRI's types; the hash is of no concern to who hears them."""
ANY_HASH = "RIHS01_" + "5" * 64


class Peer(PeerBase):
    def __init__(self, host, port):
        super().__init__()
        self.hri = {}
        self.where = {"router_ip": host, "router_port": port, "domain_id": 0}

    def _publisher(self, topic):
        publisher = ROS2Publisher(topic, "std_msgs/msg/String", STRING, node_name="sdk_robot", **self.where)
        return lambda text: publisher.publish(data=text)

    def _hri(self, topic, kind, **fields):
        if topic not in self.hri:
            self.hri[topic] = ROS2Publisher(topic, kind, HRI[kind], type_hash=ANY_HASH, node_name="hri", **self.where)
            time.sleep(0.3)
        types = self.hri[topic].session_mgr.store.types
        stamp = types["builtin_interfaces/msg/Time"](sec=1, nanosec=2)
        header = types["std_msgs/msg/Header"](stamp=stamp, frame_id="camera")
        self.hri[topic].publish(header=header, **fields)

    def tracked(self, ids):
        self._hri("/humans/persons/tracked", "hri_msgs/msg/IdsList", ids=ids)

    def engagement(self, person, level):
        self._hri(f"/humans/persons/{person}/engagement_status", "hri_msgs/msg/EngagementLevel", level=level)

    def _subscribe(self, topic, heard):
        ROS2Subscriber(
            topic, "std_msgs/msg/String", lambda message: heard(message.data), STRING, node_name="sdk_robot",
            **self.where,
        )  # fmt: skip

    def _client(self, name):
        return ROS2ServiceClient(
            name, "std_srvs/srv/Trigger", "uint8 structure_needs_at_least_one_member\n",
            "bool success\nstring message\n", type_hash=TRIGGER_HASH, node_name="sdk_robot", **self.where,
        )  # fmt: skip

    def _call(self, client, wait_s):
        client.timeout = wait_s
        response = client.call(structure_needs_at_least_one_member=0)
        return None if response is None else [bool(response.success), response.message]

    def ready(self, name):
        return bool(self.clients[name].querier.matching_status.matching)


host, port = sys.argv[1].removeprefix("tcp/").split(":")
drive(Peer(host, int(port)))
