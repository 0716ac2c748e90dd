"""A robot that Florence knows nothing of: its own names, interfaces of other packages, plain rclpy.

It drives by Nav2's action, has a gripper and a light behind services, a parameter for its speed, and tells
its battery and who presses its button. With ``--hand`` it has a hand that needs interfaces of its own
(``florence interfaces add gripper_interfaces``). ``python robot.py`` starts it; ``--battery 0.1`` empties
it, and ``--ros-args -r __ns:=/robot1/tb4`` makes it the one of
``florence up --missions-only --namespace /robot1``.
"""

from __future__ import annotations

import argparse
import time
from typing import Any

import rclpy
from nav2_msgs.action import NavigateToPose
from rclpy.action import ActionServer, CancelResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from rclpy.utilities import remove_ros_args
from sensor_msgs.msg import BatteryState
from std_msgs.msg import String
from std_srvs.srv import SetBool

PLACE_WITHOUT_WAY = 99.0
"""Nobody gets to an x beyond this."""
NO_VALID_PATH = 208
DRIVE_S = 0.5
GRIP_S = 0.3
THINNEST = 0.005
"""Metres; the hand does not feel what is thinner."""


class Robot(Node):
    """All servers of the robot."""

    def __init__(self, battery: float, *, hand: bool) -> None:
        super().__init__("robot", namespace="tb4")
        self._battery = battery
        self.declare_parameter("speed", 0.5)
        group = ReentrantCallbackGroup()
        self._server = ActionServer(
            self,
            NavigateToPose,
            "drive_to",
            self._drive,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
            callback_group=group,
        )
        if hand:
            from gripper_interfaces.action import Grip

            self._hand = ActionServer(self, Grip, "hand/grip", self._take, callback_group=group)
        self.create_service(SetBool, "gripper", self._grip)
        self.create_service(SetBool, "light", self._light)
        self._batteries = self.create_publisher(BatteryState, "battery", qos_profile_sensor_data)
        self._buttons = self.create_publisher(String, "button", 10)
        self.create_timer(0.1, self._tell, callback_group=group)

    def _tell(self) -> None:
        self._batteries.publish(BatteryState(percentage=self._battery))
        self._buttons.publish(String(data="power"))

    def _grip(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        """Close the hand; there is something in it only after a drive."""
        response.success = request.data
        response.message = "" if request.data else "the hand is open already"
        return response

    def _light(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        response.success = True
        return response

    def _take(self, goal: Any) -> Any:
        """Close the hand round what is as wide as the goal says."""
        from gripper_interfaces.action import Grip
        from gripper_interfaces.msg import Finger

        for _ in range(goal.request.tries):
            goal.publish_feedback(Grip.Feedback(width=goal.request.width))
            time.sleep(GRIP_S)
        if goal.request.width < THINNEST:
            goal.abort()
            said = f"nothing felt in {goal.request.tries} tries"
            return Grip.Result(error_code=Grip.Result.NOTHING_THERE, error_msg=said)
        goal.succeed()
        half = goal.request.width / 2.0
        fingers = [Finger(force=float(goal.request.force), position=side) for side in (half, -half)]
        return Grip.Result(fingers=fingers)

    def _drive(self, goal: Any) -> NavigateToPose.Result:
        x = goal.request.pose.pose.position.x
        if x > PLACE_WITHOUT_WAY:
            goal.abort()
            return NavigateToPose.Result(error_code=NO_VALID_PATH, error_msg=f"no way to x = {x:g}")
        end = time.monotonic() + DRIVE_S * max(1.0, abs(x))
        while (rest := end - time.monotonic()) > 0.0:
            if goal.is_cancel_requested:
                goal.canceled()
                return NavigateToPose.Result()
            goal.publish_feedback(NavigateToPose.Feedback(distance_remaining=rest))
            time.sleep(0.05)
        goal.succeed()
        return NavigateToPose.Result()


def main() -> None:
    """Serve until a signal comes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--battery", type=float, default=0.8, help="its charge, 0 to 1")
    parser.add_argument("--hand", action="store_true", help="with the hand of gripper_interfaces")
    arguments = parser.parse_args(remove_ros_args()[1:])
    rclpy.init()
    executor = MultiThreadedExecutor(4)
    executor.add_node(Robot(arguments.battery, hand=arguments.hand))
    print("the robot is there", flush=True)
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        return


if __name__ == "__main__":
    main()
