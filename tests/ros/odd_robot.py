"""A robot whose names, types and states are not what a file of skills says: plain rclpy, no Florence.

It prints ``the robot is there``. Its pump serves a dose only when somebody has activated it.
"""

import rclpy
from nav2_msgs.action import Spin
from rclpy.action import ActionServer
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn
from std_msgs.msg import Float64, String
from std_srvs.srv import SetBool, Trigger


class Pump(LifecycleNode):
    """Has its service from its activation on."""

    def on_activate(self, state):
        self.create_service(Trigger, "dose", lambda request, response: Trigger.Response(success=True))
        return TransitionCallbackReturn.SUCCESS


def main():
    rclpy.init()
    node, pump = rclpy.create_node("cart", namespace="/cart"), Pump("pump", namespace="/cart")
    node.create_service(SetBool, "scan", lambda request, response: response)
    ActionServer(node, Spin, "water", lambda goal: Spin.Result())
    door = node.create_publisher(String, "door", 10)
    speed = node.create_publisher(Float64, "flow", 10)

    def tell():
        door.publish(String(data="open"))
        speed.publish(Float64(data=float("nan")))

    node.create_timer(0.1, tell)
    node.create_subscription(String, "shout", lambda message: None, 10)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    executor.add_node(pump)
    print("the robot is there", flush=True)
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        return


main()
