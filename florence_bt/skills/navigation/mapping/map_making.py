"""Mapping as a component: the laser's own scans, odometry and the bumper in; the map and the place in it out.

It takes the place of the map server and of localisation.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated

import numpy as np

from florence_bt.core import topic_names
from florence_bt.core.clock import call_every
from florence_bt.core.diagnosis import DIAGNOSIS_PERIOD_S, Diagnoses, Diagnosis, Severity
from florence_bt.core.geometry import Pose2
from florence_bt.core.limits import CheckedParameters, Limits, NotNegative, Positive
from florence_bt.core.ports import NOT_SAVED_PERIOD_S, Ports, Topic
from florence_bt.core.sensing import LaserScan, OccupancyGrid, Odometry
from florence_bt.core.topics import DIAGNOSES, MAP, ODOMETRY, SCAN
from florence_bt.core.transforms import Transform3, TransformUnavailable
from florence_bt.skills.navigation.localisation.place import PlacePublisher
from florence_bt.skills.navigation.localisation.scan_queue import ScanQueue
from florence_bt.skills.navigation.mapping.drive import load_drive, save_drive
from florence_bt.skills.navigation.mapping.growing_map import GrowingMap, GrowingMapParameters, MapMaker

_MOST_UNDER_WAY = 5
"""Scans that wait or are worked on at most; further ones are left out: the next one says as much. What fails
stays under way: a map that cannot go on takes nothing any more."""
_BUMP_RIGHT, _BUMP_LEFT = 1, 2
"""Bits of ``bumps_wheeldrops`` (REFERENCE 1.4)."""
_COVARIANCE = np.diag(np.square([0.05, 0.05, 0.02]))
"""Of the pose, metres and radians; chosen: what is known is how the scans fit to each other."""


@dataclass(frozen=True, slots=True)
class MapMakingParameters(CheckedParameters):
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
class Bumps:
    """The bumper, as ``florence_interfaces/TurtlebotSensorState`` has it."""

    bumps_wheeldrops: int


BUMPS = Topic(topic_names.SENSOR_STATE, Bumps, interface="florence_interfaces/msg/TurtlebotSensorState")


@dataclass(frozen=True, slots=True)
class _Made:
    """The fate of a scan.

    Attributes:
        grid: The map when it is time for a newer one.
        map_from_odom: The place of the odometry frame in the map.
        pose: base_footprint in the map at the scan.
        problem: Why the drive is not kept, empty when it is, or was not to be.
    """

    grid: OccupancyGrid | None
    map_from_odom: Pose2 | None
    pose: Pose2 | None
    problem: str


class MapMaking:
    """Makes the map beside the rest: closing a loop must not hold up the drive.

    Args:
        ports: Its connections.
        maker: Makes the map.
        growing: When it is drawn.
        parameters: Its own.

    Raises:
        ConfigError: The drive to go on with cannot be read.
    """

    def __init__(
        self, ports: Ports, maker: MapMaker, growing: GrowingMapParameters, parameters: MapMakingParameters
    ) -> None:
        self._ports, self._maker, self._p = ports, maker, parameters
        p = parameters
        if p.resumed_drive:
            maker.resume(load_drive(Path(p.resumed_drive)))
        self._growing = GrowingMap(maker, growing)
        self._saved_at = ports.clock.now()
        self._map_from_odom: Pose2 | None = None
        self._touches = False
        self._under_way = 0
        self._queue = ScanQueue()
        ports.on_time_jump(self._queue.clear)
        self._frames = ports.listen_to_frames(moving=False)
        self._place = PlacePublisher(ports, p.map_frame, p.odom_frame, p.transform_tolerance)
        self._map = ports.output(MAP)
        ports.listen(SCAN, self._take_scan)
        ports.listen(ODOMETRY, self._take_odometry)
        ports.listen(BUMPS, self._take_bumps)
        call_every(ports.clock, 1.0 / p.transform_rate, self._send_transform)
        self._diagnoses = ports.output(DIAGNOSES)
        call_every(ports.clock, DIAGNOSIS_PERIOD_S, self._send_diagnosis)

    def close(self) -> None:
        """Keep the drive; nothing is worked on any more."""
        if problem := self._save_drive():
            self._ports.tell(problem, good=False)

    def _take_scan(self, scan: LaserScan) -> None:
        self._queue.add_scan(SCAN.name, scan)
        self._hand_over()

    def _take_odometry(self, odometry: Odometry) -> None:
        self._queue.add_odometry(odometry)
        self._hand_over()

    def _take_bumps(self, state: Bumps) -> None:
        """Note what a bumper meets."""
        left, right = (bool(state.bumps_wheeldrops & bit) for bit in (_BUMP_LEFT, _BUMP_RIGHT))
        before, self._touches = self._touches, left or right
        if self._touches and not before and self._queue.odometry is not None:
            touched = partial(self._growing.touched, self._queue.odometry.pose, left=left, right=right)
            self._ports.work(touched, lambda _: None)

    def _hand_over(self) -> None:
        for _, scan, odom_pose in self._queue.take_ready():
            try:
                laser_in_base = self._frames.buffer.lookup(self._p.base_frame, scan.frame_id)
            except TransformUnavailable as error:
                self._ports.warn(f"scan ignored: {error}", SCAN)
                continue
            if self._under_way < _MOST_UNDER_WAY:
                self._under_way += 1
                make = partial(self._make, scan, laser_in_base, odom_pose, self._ports.clock.now())
                self._ports.work(make, partial(self._take, scan.middle_stamp))

    def _make(self, scan: LaserScan, laser_in_base: Transform3, odom_pose: Pose2, now: float) -> _Made:
        """Work on a scan, beside the rest; keep the drive when it is time."""
        grid, problem = self._growing.update(scan, laser_in_base, odom_pose, now), ""
        if now - self._saved_at >= self._p.drive_period:
            self._saved_at = now
            problem = self._save_drive()
        return _Made(grid, self._growing.map_from_odom, self._growing.pose, problem)

    def _save_drive(self) -> str:
        """Keep the drive; return why it cannot be kept, else nothing."""
        if not self._p.drive_file or self._growing.pose is None:
            return ""
        try:
            save_drive(Path(self._p.drive_file), self._maker.drive)
        except OSError as error:
            return f"the drive is not kept: {error}"
        return ""

    def _take(self, stamp: float, made: _Made) -> None:
        """Tell what has become of a scan."""
        self._under_way -= 1
        if made.problem:
            self._ports.warn(made.problem, save_drive, NOT_SAVED_PERIOD_S)
        if made.grid is not None:
            self._map.send(made.grid)
        self._map_from_odom = made.map_from_odom
        if made.pose is not None:
            self._send_transform()
            self._place.send_pose(made.pose, _COVARIANCE, stamp)

    def _send_transform(self) -> None:
        if self._map_from_odom is not None:
            self._place.send_transform(self._map_from_odom, self._queue.odometry)

    def _send_diagnosis(self) -> None:
        diagnosis = Diagnosis(Severity.WARN, "no scan has come yet: there is no map")
        if self._map_from_odom is not None:
            progress = self._growing.progress
            values = {
                topic_names.AREA_M2: f"{progress.area:.1f}",
                topic_names.WAY_M: f"{progress.way:.1f}",
                topic_names.LOOPS: str(progress.loops),
            }
            diagnosis = Diagnosis(Severity.OK, "the map is being made", values)
        self._diagnoses.send(Diagnoses({topic_names.PLACE_STATUS: diagnosis}, self._p.map_frame))
