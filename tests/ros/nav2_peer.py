"""A program that behaves towards its clients as Nav2 does, with plain rclpy: not a line of Florence's.

    python nav2_peer.py [MAP.yaml X Y YAW]

A goal's x (target_yaw, target.x) says what becomes of it; 0 is reached after a moment:

    1  the goal is rejected
    2  it is accepted after two seconds only
    3  the process dies while it works
    4  it goes on until it is cancelled
    above 90: it is aborted with this number as its error_code, and no error_msg, as Nav2 has none

The action that the environment variable NAV2_PEER_LACKS names is not served.
With a map the program also gives out the map, a costmap, the place of the odometry in the map, and, as a
Create 3 does, how full the battery is.
"""

import math
import os
import sys
import time
from pathlib import Path

import rclpy
from geometry_msgs.msg import PoseStamped, TransformStamped
from nav2_msgs.action import (
    BackUp,
    ComputePathToPose,
    DriveOnHeading,
    NavigateThroughPoses,
    NavigateToPose,
    Spin,
)
from nav2_msgs.srv import ClearEntireCostmap
from nav_msgs.msg import OccupancyGrid
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import BatteryState
from tf2_msgs.msg import TFMessage

KINDS = (
    (NavigateToPose, "navigate_to_pose", lambda goal: goal.pose.pose.position.x),
    (NavigateThroughPoses, "navigate_through_poses", lambda goal: goal.poses[-1].pose.position.x),
    (ComputePathToPose, "compute_path_to_pose", lambda goal: goal.goal.pose.position.x),
    (Spin, "spin", lambda goal: goal.target_yaw),
    (BackUp, "backup", lambda goal: goal.target.x),
    (DriveOnHeading, "drive_on_heading", lambda goal: goal.target.x),
)
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Peer(Node):
    def __init__(self):
        super().__init__("nav2_peer")
        absent = os.environ.get("NAV2_PEER_LACKS")
        self._servers = [self._serve(*kind) for kind in KINDS if kind[1] != absent]
        for which in ("global", "local"):
            name = f"{which}_costmap/clear_entirely_{which}_costmap"
            self.create_service(ClearEntireCostmap, name, self._clear)
        self._publishers = []

    def _serve(self, kind, name, number_of):
        def decide(goal):
            number = round(number_of(goal))
            if number == 2:
                time.sleep(2.0)
            return GoalResponse.REJECT if number == 1 else GoalResponse.ACCEPT

        def work(handle):
            return self._work(kind, handle, round(number_of(handle.request)))

        return ActionServer(
            self,
            kind,
            name,
            work,
            goal_callback=decide,
            cancel_callback=lambda handle: CancelResponse.ACCEPT,
            callback_group=ReentrantCallbackGroup(),
        )

    def _work(self, kind, handle, number):
        print(kind.__name__, number, flush=True)
        handle.publish_feedback(kind.Feedback())
        if number == 3:
            os._exit(1)
        while number == 4 and not handle.is_cancel_requested:
            time.sleep(0.05)
        result = kind.Result()
        if kind is ComputePathToPose:
            result.path.poses = [PoseStamped(), handle.request.goal]
        if handle.is_cancel_requested:
            handle.canceled()
        elif number > 90:
            result.error_code = number
            handle.abort()
        else:
            handle.succeed()
        return result

    def _clear(self, request, response):
        print("cleared", flush=True)
        return response

    def give_out(self, file, x, y, yaw):
        """A map of map_server, read by hand; the same as costmap; map -> odom."""
        keys = dict(line.split(": ", 1) for line in file.read_text().splitlines() if not line.startswith("#"))
        data = (file.parent / keys["image"]).read_bytes()
        _, size, _, pixels = data.split(b"\n", 3)
        columns, rows = map(int, size.split())
        message = OccupancyGrid()
        message.header.frame_id = "map"
        message.info.resolution = float(keys["resolution"])
        message.info.width, message.info.height = columns, rows
        origin = [float(part) for part in keys["origin"].strip("[]").split(",")]
        message.info.origin.position.x, message.info.origin.position.y = origin[:2]
        message.info.origin.orientation.w = 1.0
        values = {0: 100, 254: 0}
        lines = [pixels[row * columns : (row + 1) * columns] for row in range(rows)]
        message.data = [values.get(pixel, -1) for line in reversed(lines) for pixel in line]
        for topic in ("map", "global_costmap/costmap"):
            self._publishers.append(self.create_publisher(OccupancyGrid, topic, LATCHED))
            self._publishers[-1].publish(message)
        place = TransformStamped()
        place.header.frame_id, place.child_frame_id = "map", "odom"
        place.transform.translation.x, place.transform.translation.y = x, y
        place.transform.rotation.z, place.transform.rotation.w = math.sin(yaw / 2), math.cos(yaw / 2)
        self._publishers.append(self.create_publisher(TFMessage, "/tf_static", LATCHED))
        self._publishers[-1].publish(TFMessage(transforms=[place]))
        battery = self.create_publisher(BatteryState, "battery_state", 10)
        self.create_timer(1.0, lambda: battery.publish(BatteryState(percentage=0.9)))


def main():
    rclpy.init()
    peer = Peer()
    if len(sys.argv) > 1:
        peer.give_out(Path(sys.argv[1]), *map(float, sys.argv[2:5]))
    executor = MultiThreadedExecutor(num_threads=4)
    executor.add_node(peer)
    print("up", flush=True)
    executor.spin()


if __name__ == "__main__":
    main()
