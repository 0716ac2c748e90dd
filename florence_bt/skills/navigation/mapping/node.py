"""The node ``mapping``: makes the map while the robot drives, and tells where it is in it.

It takes the place of ``map_server`` and ``localiser``.
"""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from florence_interfaces.msg import TurtlebotSensorState
from nav_msgs.msg import OccupancyGrid as OccupancyGridMsg
from nav_msgs.msg import Odometry as OdometryMsg
from sensor_msgs.msg import LaserScan as LaserScanMsg

from florence_bt.core.clock import call_every
from florence_bt.core.diagnosis import Diagnosis, Severity
from florence_bt.core.geometry import Pose2
from florence_bt.core.limits import CheckedParameters, Limits, NotNegative, Positive
from florence_bt.core.sensing import LaserScan, OccupancyGrid
from florence_bt.core.transforms import Transform3, TransformUnavailable
from florence_bt.ros.conversions import grid_to_ros, odometry_from_ros, scan_from_ros
from florence_bt.ros.diagnostics import diagnostics_publisher, diagnostics_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.place import PlacePublisher
from florence_bt.ros.qos import LATCHED, RELIABLE, SENSOR, STATE
from florence_bt.ros.tf import TransformListener
from florence_bt.ros.topics import AREA_M2, LOOPS, MAP, ODOMETRY, PLACE_STATUS, SCAN, SENSOR_STATE, WAY_M
from florence_bt.skills.navigation.localisation.scan_queue import ScanQueue
from florence_bt.skills.navigation.mapping.drive import load_drive, save_drive
from florence_bt.skills.navigation.mapping.growing_map import GrowingMap, GrowingMapParameters, MapMaker
from florence_bt.skills.navigation.mapping.parameters import SlamParameters

DIAGNOSTICS_PERIOD_S = 1.0
"""What the diagnosis is about; its values are those of :class:`Progress`."""
_MOST_WAITING = 5
"""Scans that wait for the thread at most; further ones are left out: the next one says as much."""
_BUMP_RIGHT, _BUMP_LEFT = 1, 2
"""Bits of ``bumps_wheeldrops`` (REFERENCE 1.4)."""
_COVARIANCE = np.diag(np.square([0.05, 0.05, 0.02]))
"""Of the pose, metres and radians; chosen: what is known is how the scans fit to each other."""


@dataclass(frozen=True, slots=True)
class MappingNodeParameters(CheckedParameters):
    """Frames and rates.

    Attributes:
        transform_tolerance: How far ahead ``map -> odom`` is stamped, in seconds; of the newest odometry.
        transform_rate: How often it is published, in Hz.
        map_frame: The map's frame: where the base was at the first scan.
        odom_frame: The odometry's frame.
        base_frame: The robot's frame.
        drive_file: Where the drive is kept, to go on with it; empty for nowhere.
        drive_period: Seconds between two writes of it.
        resumed_drive: The file of a drive to go on with, near where it ended; empty to begin a new map.
    """

    transform_tolerance: NotNegative = 0.2
    transform_rate: Annotated[float, Limits(0.0, 1000.0, above=True)] = 20.0
    map_frame: str = "map"
    odom_frame: str = "odom"
    base_frame: str = "base_footprint"
    drive_file: str = ""
    drive_period: Positive = 60.0
    resumed_drive: str = ""


@dataclass(frozen=True, slots=True)
class _Work:
    """A scan for the thread."""

    scan: LaserScan
    laser_in_base: Transform3
    odom_pose: Pose2
    now: float


@dataclass(frozen=True, slots=True)
class _Touch:
    """A touch of a bumper, for the thread."""

    odom_pose: Pose2
    left: bool
    right: bool


class MappingNode(FlorenceNode):
    """Feeds what makes the map on a thread of its own: closing a loop must not hold up the drive.

    Args:
        make: Makes what makes the map; by default :class:`Slam`.
        parameters: Overrides of the node's parameters.

    Raises:
        ConfigError: The extra ``mapping`` is not installed, or the drive to go on with cannot be read.
    """

    parameter_classes = (SlamParameters, GrowingMapParameters, MappingNodeParameters)

    def __init__(
        self,
        make: Callable[[SlamParameters], MapMaker] | None = None,
        *,
        parameters: Mapping[str, Any] | None = None,
        namespace: str = "",
    ) -> None:
        super().__init__("mapping", parameters=parameters, namespace=namespace)
        slam = self.read_parameters(SlamParameters)
        self._p = p = self.read_parameters(MappingNodeParameters)
        self._maker = (make or _slam)(slam)
        if p.resumed_drive:
            self._maker.resume(load_drive(Path(p.resumed_drive)))
        self._saved_at = self.timebase.now()
        self._map = GrowingMap(self._maker, self.read_parameters(GrowingMapParameters))
        self._map_from_odom: Pose2 | None = None
        self._queue = ScanQueue()
        self.ros_timebase.on_reset(self._queue.clear)
        self._frames = TransformListener(self, moving=False)
        self._place = PlacePublisher(self, p.map_frame, p.odom_frame, p.transform_tolerance)
        self._publisher = self.create_publisher(OccupancyGridMsg, MAP, LATCHED)
        self.create_subscription(LaserScanMsg, SCAN, self._on_scan, SENSOR)
        self.create_subscription(OdometryMsg, ODOMETRY, self._on_odometry, STATE)
        self._touches = False
        self.create_subscription(TurtlebotSensorState, SENSOR_STATE, self._on_base_state, RELIABLE)
        call_every(self.timebase, 1.0 / p.transform_rate, self._send_transform)
        self._diagnostics = diagnostics_publisher(self)
        call_every(self.timebase, DIAGNOSTICS_PERIOD_S, self._publish_diagnosis)
        self._work: queue.Queue[_Work | _Touch | None] = queue.Queue()
        self._thread = threading.Thread(target=self._make_map, name="mapping", daemon=True)
        self._thread.start()
        self.on_close(self._end_thread)

    def _end_thread(self) -> None:
        self._work.put(None)
        self._thread.join()
        self._save_drive()

    def _on_scan(self, message: LaserScanMsg) -> None:
        self._queue.add_scan("scan", self.timed(scan_from_ros(message)))
        self._hand_over()

    def _on_odometry(self, message: OdometryMsg) -> None:
        self._queue.add_odometry(self.timed(odometry_from_ros(message)))
        self._hand_over()

    def _on_base_state(self, message: TurtlebotSensorState) -> None:
        """Note what a bumper meets."""
        left, right = (bool(message.bumps_wheeldrops & bit) for bit in (_BUMP_LEFT, _BUMP_RIGHT))
        before, self._touches = self._touches, left or right
        if self._touches and not before and self._queue.odometry is not None:
            self._work.put(_Touch(self._queue.odometry.pose, left, right))

    def _hand_over(self) -> None:
        for _, scan, odom_pose in self._queue.take_ready():
            try:
                laser_in_base = self._frames.buffer.lookup(self._p.base_frame, scan.frame_id)
            except TransformUnavailable as error:
                self.get_logger().warning(f"scan ignored: {error}", throttle_duration_sec=5.0)
                continue
            if self._work.qsize() < _MOST_WAITING:
                self._work.put(_Work(scan, laser_in_base, odom_pose, self.timebase.now()))

    def _make_map(self) -> None:
        while (work := self._work.get()) is not None:
            try:
                if isinstance(work, _Touch):
                    self._map.touched(work.odom_pose, left=work.left, right=work.right)
                    continue
                grid = self._map.update(work.scan, work.laser_in_base, work.odom_pose, work.now)
                place = self._map.map_from_odom, self._map.pose
                if work.now - self._saved_at >= self._p.drive_period:
                    self._saved_at = work.now
                    self._save_drive()
            except Exception as error:
                self.call_soon(partial(self._raise, error))
                return
            self.call_soon(partial(self._take, work.scan.middle_stamp, place, grid))

    def _save_drive(self) -> None:
        """Keep the drive; on the thread, or after its end."""
        if not self._p.drive_file or self._map.pose is None:
            return
        try:
            save_drive(Path(self._p.drive_file), self._maker.drive)
        except OSError as error:
            self.get_logger().warning(f"the drive is not kept: {error}", throttle_duration_sec=600.0)

    @staticmethod
    def _raise(error: Exception) -> None:
        raise error

    def _take(
        self, stamp: float, place: tuple[Pose2 | None, Pose2 | None], grid: OccupancyGrid | None
    ) -> None:
        """Tell what has become of a scan."""
        if grid is not None:
            self._publisher.publish(grid_to_ros(grid, self._p.map_frame, self.stamp()))
        self._map_from_odom, pose = place
        if pose is not None:
            self._send_transform()
            self._place.publish_pose(pose, _COVARIANCE, stamp)

    def _send_transform(self) -> None:
        if self._map_from_odom is not None:
            self._place.send_transform(self._map_from_odom, self._queue.odometry)

    def _publish_diagnosis(self) -> None:
        diagnosis = Diagnosis(Severity.WARN, "no scan has come yet: there is no map")
        if self._map_from_odom is not None:
            progress = self._map.progress
            values = {
                AREA_M2: f"{progress.area:.1f}",
                WAY_M: f"{progress.way:.1f}",
                LOOPS: str(progress.loops),
            }
            diagnosis = Diagnosis(Severity.OK, "the map is being made", values)
        name, stamp = self.get_name(), self.stamp()
        self._diagnostics.publish(
            diagnostics_to_ros({PLACE_STATUS: diagnosis}, name, self._p.map_frame, stamp)
        )


def _slam(parameters: SlamParameters) -> MapMaker:
    from florence_bt.skills.navigation.mapping.slam import Slam  # loads scipy

    return Slam(parameters)
