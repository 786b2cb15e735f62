"""A Trigger server with nothing behind it, an ordinary rclpy node: what a round trip costs by itself."""

import rclpy
from rclpy.executors import SingleThreadedExecutor
from std_srvs.srv import Trigger

ANSWER = '{"decision_id":"' + "x" * 1000 + '"}'


def answer(request, response):
    response.success, response.message = True, ANSWER
    return response


rclpy.init()
node = rclpy.create_node("bare")
node.create_service(Trigger, "/bare/next_strategy", answer)
executor = SingleThreadedExecutor()
executor.add_node(node)
executor.spin()
