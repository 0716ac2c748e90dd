"""A robot that Florence knows nothing of: its own names, interfaces of other packages, plain rclpy.

It drives by Nav2's action, has a gripper behind a service, and tells its battery and who presses its button.
``python robot.py`` starts it; ``--battery 0.1`` empties it, and
``--ros-args -r __ns:=/robot1/tb4`` makes it the one of ``florence up --missions-only --namespace /robot1``.
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


class Robot(Node):
    """All servers of the robot."""

    def __init__(self, battery: float) -> None:
        super().__init__("robot", namespace="tb4")
        self._battery = battery
        group = ReentrantCallbackGroup()
        self._server = ActionServer(
            self,
            NavigateToPose,
            "drive_to",
            self._drive,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
            callback_group=group,
        )
        self.create_service(SetBool, "gripper", self._grip)
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
    arguments = parser.parse_args(remove_ros_args()[1:])
    rclpy.init()
    executor = MultiThreadedExecutor(4)
    executor.add_node(Robot(arguments.battery))
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        return


if __name__ == "__main__":
    main()
