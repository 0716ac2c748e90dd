"""Topics that several components share: each name with the type of its values, once."""

from __future__ import annotations

from dataclasses import dataclass

from florence_bt.core import topic_names
from florence_bt.core.diagnosis import Diagnoses
from florence_bt.core.ports import Delivery, Topic, pictures
from florence_bt.core.sensing import DepthImage, LaserScan, OccupancyGrid, Odometry, PoseEstimate
from florence_bt.core.zones import Zone


@dataclass(frozen=True, slots=True)
class RunState:
    """The state of a mission run, as ``florence_interfaces/RunState`` has it; see there."""

    run_id: str
    mission: str
    state: str


@dataclass(frozen=True, slots=True)
class FoundUser:
    """Somebody whom a look found, as ``florence_interfaces/DetectedUser`` has them: map frame, metres."""

    command: bool
    user_position_x: float
    user_position_y: float


DIAGNOSES = Topic(topic_names.DIAGNOSTICS, Diagnoses, Delivery.LATCHED)
FOUND = Topic(topic_names.DETECTED_USER, FoundUser, interface="florence_interfaces/msg/DetectedUser")
GLOBAL_COSTMAP = Topic(topic_names.GLOBAL_COSTMAP, OccupancyGrid, Delivery.LATCHED)
MAP = Topic(topic_names.MAP, OccupancyGrid, Delivery.LATCHED)
ODOMETRY = Topic(topic_names.ODOMETRY, Odometry, Delivery.STATE)
POSE = Topic(topic_names.AMCL_POSE, PoseEstimate, Delivery.LATCHED)
RUN_STATE = Topic(topic_names.RUN_STATE, RunState, Delivery.LATCHED, "florence_interfaces/msg/RunState")
SCAN = Topic(topic_names.SCAN, LaserScan, Delivery.SENSOR)
KINECT_SCAN = Topic(topic_names.KINECT_SCAN, LaserScan, Delivery.SENSOR)
DEPTH = pictures(topic_names.DEPTH_IMAGE, DepthImage)
ZONES: Topic[tuple[Zone, ...]] = Topic(
    topic_names.ZONES, tuple, Delivery.LATCHED, "florence_interfaces/msg/Zones"
)
