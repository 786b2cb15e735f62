"""A real ROS 1 node (rospy) as a peer; runs with Debian's Python."""

import threading
import time

import rospy
from peer_base import PeerBase, drive
from std_msgs.msg import String
from std_srvs.srv import Trigger


class Peer(PeerBase):
    def __init__(self):
        super().__init__()
        rospy.init_node("rospy_robot", disable_signals=True)

    def _publisher(self, topic):
        publisher = rospy.Publisher(topic, String, queue_size=1000)
        until = time.monotonic() + 20
        while publisher.get_num_connections() == 0 and time.monotonic() < until:
            time.sleep(0.02)
        return lambda text: publisher.publish(String(data=text))

    def _subscribe(self, topic, heard):
        rospy.Subscriber(topic, String, lambda message: heard(message.data), queue_size=1000)

    def _client(self, name):
        rospy.wait_for_service(name, 20)
        return rospy.ServiceProxy(name, Trigger)

    def _call(self, client, wait_s):
        """Call in a thread of its own: rospy's calls have no time limit."""
        answers = []

        def call():
            try:
                response = client()
                answers.append([response.success, response.message])
            except rospy.ServiceException:
                pass

        thread = threading.Thread(target=call, daemon=True)
        thread.start()
        thread.join(wait_s)
        return answers[0] if answers else None


drive(Peer())
