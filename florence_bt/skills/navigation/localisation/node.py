"""The node ``localiser``: ``map -> odom`` from the laser's own scans (document, section 3.3).

Source: REFERENCE 7.7.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from geometry_msgs.msg import PoseArray, PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid as OccupancyGridMsg
from nav_msgs.msg import Odometry as OdometryMsg
from sensor_msgs.msg import LaserScan as LaserScanMsg
from std_srvs.srv import Empty

from florence_bt.core.clock import call_every
from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.core.limits import CheckedParameters, Finite, Limits, NotNegative
from florence_bt.core.sensing import LaserScan, OccupancyGrid
from florence_bt.core.transforms import TransformUnavailable
from florence_bt.ros.conversions import (
    frame_from_ros,
    grid_from_ros,
    odometry_from_ros,
    pose_array_to_ros,
    pose_from_ros,
    scan_from_ros,
)
from florence_bt.ros.diagnostics import diagnostics_publisher, diagnostics_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.place import PlacePublisher
from florence_bt.ros.qos import LATCHED, RELIABLE, SENSOR, STATE
from florence_bt.ros.tf import TransformListener
from florence_bt.ros.topics import INITIAL_POSE, MAP, ODOMETRY, PARTICLE_CLOUD, PLACE_STATUS, SCAN
from florence_bt.skills.navigation.localisation.localiser import INITIAL_DEVIATIONS, Localiser
from florence_bt.skills.navigation.localisation.parameters import LocaliserParameters
from florence_bt.skills.navigation.localisation.quality import diagnosis_of
from florence_bt.skills.navigation.localisation.saved_pose import load_pose, save_pose
from florence_bt.skills.navigation.localisation.scan_queue import ScanQueue

DIAGNOSTICS_PERIOD_S = 1.0
INITIAL_SLACK_M = 1.0
"""So near to something that the map knows the robot may be believed (chosen: it was put down by a mouse)."""


@dataclass(frozen=True, slots=True)
class LocaliserNodeParameters(CheckedParameters):
    """Frames, rates and the initial pose.

    Attributes:
        initial_x: Where the robot is at first, in the map frame, metres.
        initial_y: Metres.
        initial_yaw: Radians.
        initial_deviation_xy: How sure that is, in metres.
        initial_deviation_yaw: In radians.
        pose_file: Where the last pose is kept, so that a restart needs none; empty for nowhere. A pose of the
            same map takes the place of the initial one, and is published once a scan has fitted there.
        save_pose_rate: How often it is written at most, in Hz.
        seed: Start of the random numbers.
        transform_tolerance: How far ahead ``map -> odom`` is stamped, in seconds; of the newest odometry.
        transform_rate: How often it is published, in Hz.
        map_frame: The map's frame.
        odom_frame: The odometry's frame.
        base_frame: The robot's frame.
    """

    initial_x: Finite = 0.0
    initial_y: Finite = 0.0
    initial_yaw: Finite = 0.0
    initial_deviation_xy: NotNegative = 0.15
    initial_deviation_yaw: NotNegative = 0.1
    pose_file: str = ""
    save_pose_rate: Annotated[float, Limits(0.0, 1000.0, above=True)] = 0.5
    seed: int = 0
    transform_tolerance: NotNegative = 0.2
    transform_rate: Annotated[float, Limits(0.0, 1000.0, above=True)] = 20.0
    map_frame: str = "map"
    odom_frame: str = "odom"
    base_frame: str = "base_footprint"


class LocaliserNode(FlorenceNode):
    """Feeds the localiser and publishes where the robot is."""

    parameter_classes = (LocaliserParameters, LocaliserNodeParameters)

    def __init__(self, *, parameters: Mapping[str, Any] | None = None, namespace: str = "") -> None:
        super().__init__("localiser", parameters=parameters, namespace=namespace)
        self._settings = self.read_parameters(LocaliserParameters)
        self._p = p = self.read_parameters(LocaliserNodeParameters)
        self._start = Pose2(p.initial_x, p.initial_y, p.initial_yaw)
        self._deviations = (p.initial_deviation_xy, p.initial_deviation_xy, p.initial_deviation_yaw)
        self._pose_set = False
        self._told_pose: tuple[Pose2, tuple[float, float, float]] | None = None
        self._localiser: Localiser | None = None
        self._queue = ScanQueue()
        self.ros_timebase.on_reset(self._queue.clear)
        self._frames = TransformListener(self, moving=False)
        self._place = PlacePublisher(self, p.map_frame, p.odom_frame, p.transform_tolerance)
        self._cloud_publisher = self.create_publisher(PoseArray, PARTICLE_CLOUD, RELIABLE)
        self.create_subscription(OccupancyGridMsg, MAP, self._on_map, LATCHED)
        self.create_subscription(LaserScanMsg, SCAN, self._on_scan, SENSOR)
        self.create_subscription(OdometryMsg, ODOMETRY, self._on_odometry, STATE)
        self.create_subscription(PoseWithCovarianceStamped, INITIAL_POSE, self._on_initial_pose, RELIABLE)
        if self._settings.refine:
            self.create_service(Empty, "reinitialize_global_localization", self._on_lose)
        call_every(self.timebase, 1.0 / p.transform_rate, self._send_transform)
        self._diagnostics = diagnostics_publisher(self)
        call_every(self.timebase, DIAGNOSTICS_PERIOD_S, self._publish_diagnosis)
        self._grid: OccupancyGrid | None = None
        self._saved: Pose2 | None = None
        if p.pose_file:
            call_every(self.timebase, 1.0 / p.save_pose_rate, self._save_pose)
            self.on_close(self._save_pose)

    def _on_map(self, message: OccupancyGridMsg) -> None:
        before, self._grid = self._localiser, grid_from_ros(message)
        self._localiser = Localiser(self._grid, self._settings, self._p.seed)
        if self._take_given_pose():
            return
        saved = self._load_pose(self._grid) if before is None else None
        if saved is not None:
            self._localiser.resume(saved, self._deviations)
            return
        self._localiser.set_pose((before and before.pose) or self._start, self._deviations)
        if before is not None and before.lost:
            self._localiser.lose()

    def _load_pose(self, grid: OccupancyGrid) -> Pose2 | None:
        if not self._p.pose_file or self._pose_set:
            return None
        try:
            return load_pose(Path(self._p.pose_file), grid)
        except ConfigError as error:
            self.get_logger().warning(f"the robot begins at the initial pose: {error}")
            return None

    def _save_pose(self) -> None:
        localiser = self._localiser
        if localiser is None or self._grid is None or localiser.map_from_odom is None:
            return
        if localiser.pose is None or localiser.pose == self._saved:
            return
        try:
            save_pose(Path(self._p.pose_file), localiser.pose, self._grid)
        except OSError as error:
            self.get_logger().warning(f"the pose is not kept: {error}", throttle_duration_sec=60.0)
            return
        self._saved = localiser.pose

    def _publish_diagnosis(self) -> None:
        if self._localiser is not None:
            found = {PLACE_STATUS: diagnosis_of(self._localiser)}
            name, stamp = self.get_name(), self.stamp()
            self._diagnostics.publish(diagnostics_to_ros(found, name, self._p.map_frame, stamp))

    def _on_initial_pose(self, message: PoseWithCovarianceStamped) -> None:
        pose, frame = pose_from_ros(message.pose.pose), frame_from_ros(message.header.frame_id)
        if frame not in ("", self._p.map_frame):
            problem = f"a pose in the frame {frame!r} (would have worked: {self._p.map_frame!r})"
            self.health.count_refused(INITIAL_POSE, problem)
            return
        variances = np.array(message.pose.covariance)[[0, 7, 35]]
        x, y, yaw = np.sqrt(np.maximum(variances, 0.0))
        given = (float(x), float(y), float(yaw))
        self._told_pose = pose, given if any(given) else INITIAL_DEVIATIONS
        self._take_given_pose()

    def _take_given_pose(self) -> bool:
        """Begin at the pose that was given last, if the map knows that place; False when there is none."""
        if self._told_pose is None or self._localiser is None or self._grid is None:
            return False
        (pose, deviations), self._told_pose = self._told_pose, None
        problem = self._grid.problem_with_place(pose.x, pose.y, INITIAL_SLACK_M)
        if problem is not None:
            told = f"({pose.x:.2f} m, {pose.y:.2f} m) is {problem} (would have worked: a place on its floor)"
            self.health.count_refused(INITIAL_POSE, told)
            return False
        self._start, self._deviations, self._pose_set = pose, deviations, True
        self._localiser.set_pose(pose, deviations)
        return True

    def _on_lose(self, _request: Empty.Request, response: Empty.Response) -> Empty.Response:
        if self._localiser is not None:
            self._localiser.lose()
        return response

    def _on_scan(self, message: LaserScanMsg) -> None:
        self._queue.add_scan("scan", self.timed(scan_from_ros(message)))
        self._work()

    def _on_odometry(self, message: OdometryMsg) -> None:
        odometry = self.timed(odometry_from_ros(message))
        if self._localiser is not None:
            self._localiser.believe(odometry.pose)
        self._queue.add_odometry(odometry)
        self._work()

    def _work(self) -> None:
        for _, scan, odom_pose in self._queue.take_ready():
            if self._localiser is not None:
                self._localise(self._localiser, scan, odom_pose)

    def _localise(self, localiser: Localiser, scan: LaserScan, odom_pose: Pose2) -> None:
        try:
            laser_in_base = self._frames.buffer.lookup(self._p.base_frame, scan.frame_id)
        except TransformUnavailable as error:
            self.get_logger().warning(f"scan ignored: {error}", throttle_duration_sec=5.0)
            return
        was_lost = localiser.lost
        map_from_odom = localiser.update(scan, laser_in_base, odom_pose)
        if localiser.lost != was_lost:
            self._report(lost=localiser.lost)
        if map_from_odom is None:
            return
        self._send_transform()
        self._publish_pose(localiser, scan.middle_stamp)

    def _report(self, *, lost: bool) -> None:
        if lost:
            self.get_logger().warning(
                "the scans do not fit the map where the robot was believed to be: the whole map is searched"
                " (a drive by hand helps, or a pose on 'initialpose')"
            )
        else:
            self.get_logger().info("the robot is found again")

    def _send_transform(self) -> None:
        if self._localiser is not None and self._localiser.map_from_odom is not None:
            self._place.send_transform(self._localiser.map_from_odom, self._queue.odometry)

    def _publish_pose(self, localiser: Localiser, stamp: float) -> None:
        assert localiser.pose is not None
        self._place.publish_pose(localiser.pose, localiser.covariance, stamp)
        if self._cloud_publisher.get_subscription_count():
            poses = (Pose2(x, y, math.remainder(yaw, math.tau)) for x, y, yaw in localiser.particles.tolist())
            self._cloud_publisher.publish(pose_array_to_ros(poses, self._p.map_frame, self.stamp(stamp)))
