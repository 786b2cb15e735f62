"""A real ROS 2 node (rclpy over FastDDS) as a peer."""

import threading
import time

import rclpy
from peer_base import PeerBase, drive
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import String
from std_srvs.srv import Trigger

BEST_EFFORT = ("gaze",)


class Peer(PeerBase):
    def __init__(self):
        super().__init__()
        rclpy.init()
        self.node = rclpy.create_node("rclpy_robot")
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        threading.Thread(target=self.executor.spin, daemon=True).start()

    def _publisher(self, topic):
        best_effort = topic.endswith(BEST_EFFORT)
        qos = QoSProfile(
            depth=1000 if best_effort else 10,
            reliability=ReliabilityPolicy.BEST_EFFORT if best_effort else ReliabilityPolicy.RELIABLE,
        )
        publisher = self.node.create_publisher(String, topic, qos)
        until = time.monotonic() + 20
        while publisher.get_subscription_count() == 0 and time.monotonic() < until:
            time.sleep(0.02)
        return lambda text: publisher.publish(String(data=text))

    def _subscribe(self, topic, heard):
        self.node.create_subscription(String, topic, lambda message: heard(message.data), 1000)
        self.executor.wake()

    def _client(self, name):
        client = self.node.create_client(Trigger, name)
        self.executor.wake()
        assert client.wait_for_service(20), name
        return client

    def _call(self, client, wait_s):
        done = threading.Event()
        future = client.call_async(Trigger.Request())
        future.add_done_callback(lambda _: done.set())
        if not done.wait(wait_s):
            client.remove_pending_request(future)
            return None
        response = future.result()
        return [response.success, response.message]

    def ready(self, name):
        return bool(self.clients[name].service_is_ready())

    def publishers_of(self, topic):
        return self.node.count_publishers(topic)

    def graph(self):
        return {
            "nodes": sorted(ns.rstrip("/") + "/" + n for n, ns in self.node.get_node_names_and_namespaces()),
            "topics": dict(self.node.get_topic_names_and_types()),
            "services": dict(self.node.get_service_names_and_types()),
        }


drive(Peer())
