"""Topics of values of ``core`` that several components share."""

from __future__ import annotations

from dataclasses import dataclass

from florence_bt.core.diagnosis import Diagnoses
from florence_bt.core.ports import Delivery, Topic
from florence_bt.core.sensing import LaserScan, OccupancyGrid, Odometry, PoseEstimate
from florence_bt.core.zones import Zone


@dataclass(frozen=True, slots=True)
class RunState:
    """The state of a mission run, as ``florence_interfaces/RunState`` has it; see there."""

    run_id: str
    mission: str
    state: str


@dataclass(frozen=True, slots=True)
class FoundUser:
    """Where a look found somebody, as ``florence_interfaces/DetectedUser`` has it: map frame, metres."""

    command: bool
    user_position_x: float
    user_position_y: float


DIAGNOSES = Topic("diagnostics", Diagnoses, Delivery.LATCHED)
FOUND = Topic("detected_user", FoundUser, interface="florence_interfaces/msg/DetectedUser")
GLOBAL_COSTMAP = Topic("global_costmap/costmap", OccupancyGrid, Delivery.LATCHED)
MAP = Topic("map", OccupancyGrid, Delivery.LATCHED)
ODOMETRY = Topic("odom", Odometry, Delivery.STATE)
POSE = Topic("amcl_pose", PoseEstimate, Delivery.LATCHED)
RUN_STATE = Topic("florence_bt/run_state", RunState, Delivery.LATCHED, "florence_interfaces/msg/RunState")
SCAN = Topic("scan", LaserScan, Delivery.SENSOR)
"""The laser's own scans."""
ZONES: Topic[tuple[Zone, ...]] = Topic("zones", tuple, Delivery.LATCHED, "florence_interfaces/msg/Zones")
"""Where the robot does not drive, or drives slowly."""
