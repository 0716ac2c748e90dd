"""The node ``navigate``: :class:`Navigation` on ROS.

A pose on ``goal_pose`` (RViz) is sent on to the own action, as in Nav2: so every drive can be listed and
cancelled as a goal.
"""

from __future__ import annotations

import uuid
from collections.abc import Mapping
from typing import Any

from geometry_msgs.msg import PoseStamped
from nav2_msgs.action import NavigateToPose
from nav_msgs.msg import OccupancyGrid as OccupancyGridMsg
from nav_msgs.msg import Path
from unique_identifier_msgs.msg import UUID

from florence_bt.core.geometry import FramedPath, FramedPose
from florence_bt.core.ports import Topic
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.core.topic_names import GOAL_POSE
from florence_bt.core.topics import GLOBAL_COSTMAP, ZONES
from florence_bt.ros.conversions import grid_to_ros, path_to_ros, pose_stamped_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.ports import RosPorts, ToRos
from florence_bt.ros.qos import RELIABLE
from florence_bt.ros.zones import zones_from_ros
from florence_bt.skills.navigation.navigate.navigation import (
    CURRENT_GOAL,
    LOCAL_COSTMAP,
    PLAN,
    Navigation,
    NavigationParameters,
)
from florence_bt.skills.navigation.navigate.parameters import REPLACED_PARAMETERS, NavigatorParameters

SendGoal = NavigateToPose.Impl.SendGoalService


class NavigationNode(FlorenceNode):
    """Serves goals one at a time; works only while one is active.

    Attributes:
        navigation: What does it.
    """

    replaced_parameters = REPLACED_PARAMETERS
    parameter_classes = (*NavigatorParameters.CLASSES, NavigationParameters)

    def __init__(self, *, parameters: Mapping[str, Any] | None = None, namespace: str = "") -> None:
        super().__init__("navigate", parameters=parameters, namespace=namespace)
        settings = NavigatorParameters.read(self.read_parameters)
        own = self.read_parameters(NavigationParameters)
        to_ros: dict[Topic[Any], ToRos] = {
            PLAN: self._path,
            CURRENT_GOAL: self._pose,
            GLOBAL_COSTMAP: lambda grid: self._grid(grid, own.map_frame),
            LOCAL_COSTMAP: lambda grid: self._grid(grid, own.odom_frame),
        }
        ports = RosPorts(self, to_ros, {ZONES: zones_from_ros})
        self.navigation = Navigation(ports, settings, own)
        action = self.resolve_action_name("navigate_to_pose")
        self._own_goals = self.create_client(SendGoal, f"{action}/_action/send_goal")
        self.create_subscription(PoseStamped, GOAL_POSE, self._on_goal_pose, RELIABLE)

    def close(self) -> None:
        """Stop the robot."""
        self.navigation.close()

    def on_failure(self, reason: str) -> None:
        """Stop the robot and end the goal."""
        self.navigation.fail(reason)

    def _on_goal_pose(self, message: PoseStamped) -> None:
        refusal = self.navigation.why_not()
        if refusal is None and not self._own_goals.service_is_ready():
            refusal = "the node is just starting; ask again"
        if refusal is not None:
            self.get_logger().warning(f"goal_pose ignored: {refusal}")
            return
        goal = NavigateToPose.Goal(pose=message)
        goal_id = UUID(uuid=list(uuid.uuid4().bytes))
        self._own_goals.call_async(SendGoal.Request(goal_id=goal_id, goal=goal))

    def _path(self, way: FramedPath) -> Path:
        return path_to_ros(way.poses, way.frame, self.stamp())

    def _pose(self, given: FramedPose) -> PoseStamped:
        return pose_stamped_to_ros(given.pose, given.frame, self.stamp()) if given.frame else PoseStamped()

    def _grid(self, grid: OccupancyGrid, frame: str) -> OccupancyGridMsg:
        return grid_to_ros(grid, frame, self.stamp())
