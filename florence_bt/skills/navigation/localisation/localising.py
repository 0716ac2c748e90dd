"""Localisation as a component: the laser's own scans, odometry and the map in; where the robot is out.

Source: document, section 3.3; REFERENCE 7.7.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np

from florence_bt.core import topic_names
from florence_bt.core.clock import call_every
from florence_bt.core.diagnosis import DIAGNOSIS_PERIOD_S, Diagnoses
from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.core.limits import CheckedParameters, Finite, Limits, NotNegative
from florence_bt.core.ports import NOT_SAVED_PERIOD_S, Fields, NoFields, Ports, Service, Topic
from florence_bt.core.sensing import LaserScan, OccupancyGrid, Odometry, PoseEstimate
from florence_bt.core.topic_names import INITIAL_POSE as INITIAL_POSE_TOPIC
from florence_bt.core.topics import DIAGNOSES, MAP, ODOMETRY, SCAN
from florence_bt.core.transforms import TransformUnavailable
from florence_bt.skills.navigation.localisation.localiser import INITIAL_DEVIATIONS, Localiser
from florence_bt.skills.navigation.localisation.parameters import LocaliserParameters
from florence_bt.skills.navigation.localisation.place import PlacePublisher
from florence_bt.skills.navigation.localisation.quality import diagnosis_of
from florence_bt.skills.navigation.localisation.saved_pose import load_pose, save_pose
from florence_bt.skills.navigation.localisation.scan_queue import ScanQueue

INITIAL_SLACK_M = 1.0
"""So near to something that the map knows the robot may be believed (chosen: it was put down by a mouse)."""


@dataclass(frozen=True, slots=True)
class LocalisingParameters(CheckedParameters):
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


@dataclass(frozen=True, slots=True)
class Particles:
    """The poses that the particle filter follows, for viewers.

    Attributes:
        stamp: Seconds.
        frame: Their frame.
        poses: base_footprint.
    """

    stamp: float
    frame: str
    poses: tuple[Pose2, ...]


INITIAL_POSE = Topic(INITIAL_POSE_TOPIC, PoseEstimate)
PARTICLES = Topic(topic_names.PARTICLE_CLOUD, Particles, interface="geometry_msgs/msg/PoseArray")
LOSE = Service("reinitialize_global_localization", "std_srvs/srv/Empty")


class Localising:
    """Feeds the localiser and publishes where the robot is.

    Args:
        ports: Its connections.
        settings: Of the localiser.
        parameters: Its own.

    Attributes:
        localiser: What finds the robot; None before a map has come.
    """

    def __init__(self, ports: Ports, settings: LocaliserParameters, parameters: LocalisingParameters) -> None:
        self._ports, self._settings, self._p = ports, settings, parameters
        p = parameters
        self._start = Pose2(p.initial_x, p.initial_y, p.initial_yaw)
        self._deviations = (p.initial_deviation_xy, p.initial_deviation_xy, p.initial_deviation_yaw)
        self._pose_set = False
        self._told_pose: tuple[Pose2, tuple[float, float, float]] | None = None
        self.localiser: Localiser | None = None
        self._grid: OccupancyGrid | None = None
        self._saved: Pose2 | None = None
        self._queue = ScanQueue()
        ports.on_time_jump(self._queue.clear)
        self._frames = ports.listen_to_frames(moving=False)
        self._place = PlacePublisher(ports, p.map_frame, p.odom_frame, p.transform_tolerance)
        self._particles = ports.output(PARTICLES)
        ports.listen(MAP, self._take_map)
        ports.listen(SCAN, self._take_scan)
        ports.listen(ODOMETRY, self._take_odometry)
        ports.listen(INITIAL_POSE, self._take_initial_pose)
        if settings.refine:
            ports.serve(LOSE, self._lose)
        call_every(ports.clock, 1.0 / p.transform_rate, self._send_transform)
        self._diagnoses = ports.output(DIAGNOSES)
        call_every(ports.clock, DIAGNOSIS_PERIOD_S, self._send_diagnosis)
        if p.pose_file:
            call_every(ports.clock, 1.0 / p.save_pose_rate, self._save_pose)

    def close(self) -> None:
        """Keep the last pose."""
        if self._p.pose_file:
            self._save_pose()

    def _take_map(self, grid: OccupancyGrid) -> None:
        before, self._grid = self.localiser, grid
        self.localiser = Localiser(grid, self._settings, self._p.seed)
        if self._take_given_pose():
            return
        saved = self._load_pose(grid) if before is None else None
        if saved is not None:
            self.localiser.resume(saved, self._deviations)
            return
        self.localiser.set_pose((before and before.pose) or self._start, self._deviations)
        if before is not None and before.lost:
            self.localiser.lose()

    def _load_pose(self, grid: OccupancyGrid) -> Pose2 | None:
        if not self._p.pose_file or self._pose_set:
            return None
        try:
            return load_pose(Path(self._p.pose_file), grid)
        except ConfigError as error:
            self._ports.tell(f"the robot begins at the initial pose: {error}", good=False)
            return None

    def _save_pose(self) -> None:
        localiser = self.localiser
        if localiser is None or self._grid is None or localiser.map_from_odom is None:
            return
        if localiser.pose is None or localiser.pose == self._saved:
            return
        try:
            save_pose(Path(self._p.pose_file), localiser.pose, self._grid)
        except OSError as error:
            self._ports.warn(f"the pose is not kept: {error}", save_pose, NOT_SAVED_PERIOD_S)
            return
        self._saved = localiser.pose

    def _send_diagnosis(self) -> None:
        if self.localiser is not None:
            found = {topic_names.PLACE_STATUS: diagnosis_of(self.localiser)}
            self._diagnoses.send(Diagnoses(found, self._p.map_frame))

    def _take_initial_pose(self, told: PoseEstimate) -> None:
        if told.frame not in ("", self._p.map_frame):
            problem = f"a pose in the frame {told.frame!r} (would have worked: {self._p.map_frame!r})"
            self._ports.refuse(INITIAL_POSE.name, problem)
            return
        x, y, yaw = np.sqrt(np.maximum(told.covariance.diagonal(), 0.0)).tolist()
        self._told_pose = told.pose, (x, y, yaw) if x or y or yaw else INITIAL_DEVIATIONS
        self._take_given_pose()

    def _take_given_pose(self) -> bool:
        """Begin at the pose that was given last, if the map knows that place; False when there is none."""
        if self._told_pose is None or self.localiser is None or self._grid is None:
            return False
        (pose, deviations), self._told_pose = self._told_pose, None
        problem = self._grid.problem_with_place(pose.x, pose.y, INITIAL_SLACK_M)
        if problem is not None:
            told = f"({pose.x:.2f} m, {pose.y:.2f} m) is {problem} (would have worked: a place on its floor)"
            self._ports.refuse(INITIAL_POSE.name, told)
            return False
        self._start, self._deviations, self._pose_set = pose, deviations, True
        self.localiser.set_pose(pose, deviations)
        return True

    def _lose(self, _: NoFields) -> Fields:
        if self.localiser is not None:
            self.localiser.lose()
        return {}

    def _take_scan(self, scan: LaserScan) -> None:
        self._queue.add_scan(SCAN.name, scan)
        self._work()

    def _take_odometry(self, odometry: Odometry) -> None:
        if self.localiser is not None:
            self.localiser.believe(odometry.pose)
        self._queue.add_odometry(odometry)
        self._work()

    def _work(self) -> None:
        for _, scan, odom_pose in self._queue.take_ready():
            if self.localiser is not None:
                self._localise(self.localiser, scan, odom_pose)

    def _localise(self, localiser: Localiser, scan: LaserScan, odom_pose: Pose2) -> None:
        try:
            laser_in_base = self._frames.buffer.lookup(self._p.base_frame, scan.frame_id)
        except TransformUnavailable as error:
            self._ports.warn(f"scan ignored: {error}", SCAN)
            return
        was_lost = localiser.lost
        map_from_odom = localiser.update(scan, laser_in_base, odom_pose)
        if localiser.lost != was_lost:
            self._report(lost=localiser.lost)
        if map_from_odom is None:
            return
        self._send_transform()
        self._send_pose(localiser, scan.middle_stamp)

    def _report(self, *, lost: bool) -> None:
        if lost:
            told = (
                "the scans do not fit the map where the robot was believed to be: the whole map is searched"
                " (a drive by hand helps, or a pose on 'initialpose')"
            )
        else:
            told = "the robot is found again"
        self._ports.tell(told, good=not lost)

    def _send_transform(self) -> None:
        if self.localiser is not None and self.localiser.map_from_odom is not None:
            self._place.send_transform(self.localiser.map_from_odom, self._queue.odometry)

    def _send_pose(self, localiser: Localiser, stamp: float) -> None:
        assert localiser.pose is not None
        self._place.send_pose(localiser.pose, localiser.covariance, stamp)
        if self._particles.listeners:
            poses = (Pose2(x, y, math.remainder(yaw, math.tau)) for x, y, yaw in localiser.particles.tolist())
            self._particles.send(Particles(stamp, self._p.map_frame, tuple(poses)))
