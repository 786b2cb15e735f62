"""A stand-in of RISE's server, which follows RISE's public documentation: it takes goals, and keeps a memory.

It is no part of RISE. It answers on standard input as every peer does, and it makes its message class from an action
file of its own, so that a definition that differs from the bridge's is refused by ROS itself.
"""

import json
import sys

import rospy
from genpy.dynamic import generate_dynamic
from peer_base import PeerBase, drive

TYPE = "ros_tcp_endpoint/DomainTaskActionGoal"
DIVIDER = "\n" + "=" * 80 + "\n"
GOAL = DIVIDER.join([
    "Header header\nactionlib_msgs/GoalID goal_id\nros_tcp_endpoint/DomainTaskGoal goal",
    "MSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id",
    "MSG: actionlib_msgs/GoalID\ntime stamp\nstring id",
    "MSG: ros_tcp_endpoint/DomainTaskGoal\n{fields}",
])  # fmt: skip


class StandIn(PeerBase):
    def __init__(self, fields):
        super().__init__()
        rospy.init_node("rise", disable_signals=True)
        self.kind = generate_dynamic(TYPE, GOAL.format(fields=fields))[TYPE]
        self.memory, self.events, self.goals = {}, [], []
        rospy.Subscriber("/rise/set/domainTask/goal", self.kind, self._on_goal, queue_size=100)

    def checksum(self):
        return self.kind._md5sum

    def _on_goal(self, message):
        goal = message.goal
        if message.goal_id.id in [known for known, _, _ in self.goals]:
            return  # an action server takes a goal's id once
        self.goals.append([message.goal_id.id, goal.function_type, goal.calling_type])
        if goal.function_type == "assignValue":
            self.memory.update(json.loads(goal.domain_task_behavior))
        elif goal.function_type == "raiseEventTopic":
            self.events.append([goal.domain_task_behavior, self.memory.get("shift", {}).get("decision_id")])

    def state(self):
        return {"memory": self.memory, "events": self.events, "goals": self.goals}


drive(StandIn(sys.argv[1].replace(",", "\n")))
