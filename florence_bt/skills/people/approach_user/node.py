"""The approach of a user on ROS (``approach_user``): proposes poses and publishes how the approach goes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from florence_interfaces.msg import RunState
from florence_interfaces.srv import ProposeApproach
from nav_msgs.msg import OccupancyGrid as OccupancyGridMsg
from std_msgs.msg import String

from florence_bt.core.clock import Timer, call_every
from florence_bt.core.errors import FlorenceError
from florence_bt.core.geometry import Pose2
from florence_bt.core.limits import CheckedParameters, Positive
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.ros.conversions import grid_from_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED, RELIABLE
from florence_bt.ros.topics import APPROACH_STATUS, GLOBAL_COSTMAP, RUN_STATE
from florence_bt.skills.people.approach_user.approach_status import ApproachStatus
from florence_bt.skills.people.approach_user.polite_pose import DEFAULT_SAFE_DISTANCE, Proposals
from florence_bt.skills.robot_description.room import RoomParameters

UNCHECKED = "unchecked: no costmap was received yet"


@dataclass(frozen=True, slots=True)
class ApproachNodeParameters(CheckedParameters):
    """Parameters of the approach.

    Attributes:
        safe_distance: Distance to the user when a request asks for 0, metres (document, table 13).
        status_period_s: Seconds between two repeats of the status (REFERENCE 12.2, row 1).
    """

    safe_distance: Positive = DEFAULT_SAFE_DISTANCE
    status_period_s: Positive = 0.2


class ApproachNode(FlorenceNode):
    """Serves ``approach_user/propose`` and publishes ``approach_user/status``.

    Args:
        parameters: Overrides of the node's parameters.
    """

    parameter_classes = (ApproachNodeParameters, RoomParameters)

    def __init__(self, *, parameters: Mapping[str, Any] | None = None) -> None:
        super().__init__("approach_user", parameters=parameters)
        self._params = self.read_parameters(ApproachNodeParameters)
        self._room = self.read_parameters(RoomParameters)
        self._costmap: OccupancyGrid | None = None
        self._proposals = Proposals()
        self._status = ApproachStatus()
        self._timer: Timer | None = None
        self._status_topic = self.create_publisher(String, APPROACH_STATUS, RELIABLE)
        self.create_subscription(OccupancyGridMsg, GLOBAL_COSTMAP, self._on_costmap, LATCHED)
        self.create_subscription(RunState, RUN_STATE, self._on_run_state, LATCHED)
        self.create_service(ProposeApproach, "approach_user/propose", self._on_propose)

    def _on_costmap(self, message: OccupancyGridMsg) -> None:
        try:
            self._costmap = grid_from_ros(message)
        except FlorenceError as error:
            self.get_logger().warning(f"the costmap is left out: {error}", throttle_duration_sec=5.0)

    def _on_propose(
        self, request: ProposeApproach.Request, response: ProposeApproach.Response
    ) -> ProposeApproach.Response:
        result = self._proposals.propose(
            Pose2(request.user_x, request.user_y),
            Pose2(request.robot_x, request.robot_y),
            request.trial,
            request.safe_distance or self._params.safe_distance,
            self._costmap,
            self._room,
        )
        response.valid, response.message = result.succeeded, result.reason
        if result.succeeded and self._costmap is None:
            response.message = UNCHECKED
        pose = result.outputs.get("pose")
        if pose is not None:
            response.x, response.y, response.phi = pose.x, pose.y, pose.yaw
        return response

    def _on_run_state(self, message: RunState) -> None:
        if self._status.take(message.run_id, message.mission, message.state) and self._timer is None:
            period = self._params.status_period_s
            self._timer = call_every(self.timebase, period, self._repeat, start=self.timebase.now())

    def _repeat(self) -> None:
        word = self._status.next_word()
        if word is None:
            if self._timer is not None:
                self._timer.cancel()
                self._timer = None
            return
        self._status_topic.publish(String(data=word))
