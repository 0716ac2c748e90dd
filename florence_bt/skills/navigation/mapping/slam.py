"""Simultaneous localisation and mapping: scans and odometry in, the map and the robot's pose in it out.

The laser odometry follows the robot from scan to scan; where it comes back to a place it is recognised
(:mod:`loop_finder`), and the poses of all kept scans move to where everything agrees (:mod:`pose_graph`).
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import Pose2, angle_difference
from florence_bt.core.sensing import LaserScan, OccupancyGrid
from florence_bt.core.transforms import Transform3
from florence_bt.skills.navigation.localisation.laser_odometry import LaserOdometry
from florence_bt.skills.navigation.mapping.drive import MappedDrive
from florence_bt.skills.navigation.mapping.kept_scan import KeptScan, keep_scan
from florence_bt.skills.navigation.mapping.loop_finder import LoopFinder
from florence_bt.skills.navigation.mapping.map_drawer import MapDrawer
from florence_bt.skills.navigation.mapping.parameters import SlamParameters
from florence_bt.skills.navigation.mapping.pose_graph import PoseGraph, Tie

_MIN_POINTS = 10
"""Points of a scan below which nothing is fitted. Chosen."""
_REST_M, _REST_RAD = 0.002, 0.002
"""Motion by the odometry below which the robot stands. Chosen."""
_LEAST = np.diag(np.square([0.01, 0.01, 0.004]))
"""A step from one kept scan to the next is never surer."""
_TORN_M, _TORN_RAD, _TORN_WAYS, _PUT_DOWN_M = 0.4, 0.4, 25.0, 1.5
"""Error of a scan that nothing ties to the last ones, besides twice the step, metres and radians; the metres
of way that make the odometry a metre more unsure; error of the robot's place when a drive goes on."""
_LONG_M = 0.4
"""Longer steps from scan to scan are the more unsure: less of what was seen is seen again."""
_LOOSE_M = 3.0
"""A scan that nothing ties to those before is looked for on so many metres, until it is found."""
_RESET_M = 5.0
"""No robot drives so far from scan to scan."""
_LOOK_EVERY = 2
"""Kept scans from one search for known places to the next."""
_JUMP_M, _JUMP_RAD, _MOST_WAITING = 0.15, 0.05, 10
"""The past is corrected when the robot would be so far from where it is believed to be, or after so many
ties."""


class Slam:
    """Builds a map while the robot drives.

    The map's origin is where the base was at the first scan.

    Attributes:
        revision: Grows when the past was corrected: what was drawn before is to be drawn anew.
        loops: How many ties hold places together that the robot came back to.
        torn: How many times a scan fitted nothing of the last ones: somebody carried the robot, or it went
            far between two scans.

    Raises:
        ConfigError: The extra ``mapping`` is not installed.
    """

    def __init__(self, parameters: SlamParameters | None = None) -> None:
        self._parameters = p = parameters or SlamParameters()
        self._scans: list[KeptScan] = []
        self._graph = PoseGraph(Pose2())
        self._finder = LoopFinder(self._scans, self._graph, p.loop_least_way, p.loop_fit)
        self._odometry = LaserOdometry()
        self._unsure: NDArray[np.float64] = np.zeros((3, 3))
        self._torn = self._resumed = False
        self._loose_m = math.inf
        self._mended = Pose2()
        self._odom: Pose2 | None = None
        self._waiting = 0
        self._drawer = MapDrawer(p)
        self._touches: list[tuple[int, Pose2]] = []
        self.revision = self.loops = self.torn = 0

    @property
    def pose(self) -> Pose2:
        """base_footprint in the map at the newest scan."""
        return self._graph.poses[-1] @ self.since_kept

    @property
    def map_from_odom(self) -> Pose2:
        """The place of the odometry frame in the map."""
        return self.pose @ self._odom.inverse() if self._odom else Pose2()

    @property
    def poses(self) -> tuple[Pose2, ...]:
        """base_footprint in the map at each kept scan, as is known now."""
        return tuple(self._graph.poses[: len(self._scans)])

    @property
    def scans(self) -> tuple[KeptScan, ...]:
        """The kept scans, of which the map consists."""
        return tuple(self._scans)

    @property
    def since_kept(self) -> Pose2:
        """base_footprint at the newest scan, as seen from where the last kept one was taken."""
        return self._finder.driven[-1].inverse() @ self._odometry.pose if self._scans else Pose2()

    def update(self, scan: LaserScan, laser_in_base: Transform3, odom_pose: Pose2) -> bool:
        """Take a scan.

        Args:
            scan: The laser's own scan, not the filtered one.
            laser_in_base: The laser's frame in base_footprint; a laser that hangs upside down is turned by
                this alone.
            odom_pose: base_footprint in the odometry frame at the scan's middle.

        Returns:
            Whether the scan was kept: the map has more in it than before.

        Raises:
            ConfigError: The map would become too large.
        """
        if not odom_pose.is_finite() or self._rests(odom_pose):
            return False
        self._mend(odom_pose)
        seen = keep_scan(scan, laser_in_base, self._parameters)
        if len(seen.points) < _MIN_POINTS:
            return False
        told = self._mended @ odom_pose
        self._odometry.update(seen.points.astype(float), told, len(scan.ranges))
        self._odom = odom_pose
        self._unsure = self._unsure + self._odometry.covariance
        self._torn = self._torn or self._odometry.broken or self._resumed
        if self._scans and not self._torn and not self._is_far():
            return False
        self._keep(seen)
        return True

    def _rests(self, odom_pose: Pose2) -> bool:
        return self._odom is not None and not _moved(self._odom, odom_pose, _REST_M, _REST_RAD)

    def _mend(self, odom_pose: Pose2) -> None:
        """Take the odometry as standing still where it jumps: its driver was started anew."""
        if self._odom is not None and self._odom.distance_to(odom_pose) > _RESET_M:
            self._mended = self._mended @ self._odom @ odom_pose.inverse()
            self._odom, self._torn = odom_pose, True

    def _is_far(self) -> bool:
        return _moved(Pose2(), self.since_kept, self._parameters.keep_d, self._parameters.keep_a)

    def _keep(self, seen: KeptScan) -> None:
        step, torn = self.since_kept, self._torn
        metres = math.hypot(step.x, step.y)
        way = metres * max(1.0, metres / _LONG_M)
        wrong = 2.0 * metres + (_PUT_DOWN_M if self._resumed else _TORN_M)
        if torn:
            way += wrong * _TORN_WAYS
        if self._scans:
            covariance = self._unsure + _LEAST
            if torn:
                covariance = np.diag(np.square([wrong, wrong, _TORN_RAD]))
            number = len(self._scans)
            self._graph.add_step(Tie(number - 1, number, step, covariance, way))
            self.torn += torn
        self._scans.append(seen)
        self._finder.add(
            self._odometry.pose, way + (self._finder.ways[-1] if self._finder.ways else 0.0), torn=torn
        )
        self._unsure, self._torn, self._resumed = np.zeros((3, 3)), False, False
        if not self._parameters.close_loops:
            return
        self._loose_m = 0.0 if torn else self._loose_m + metres
        if self._loose_m <= _LOOSE_M:
            ties = self._finder.rejoin()
            self._tie(ties)
            if ties:
                self._loose_m = math.inf
        elif len(self._scans) % _LOOK_EVERY == 0:
            self._tie(self._finder.find())

    def _tie(self, ties: Iterable[Tie]) -> None:
        graph, far = self._graph, False
        for tie in ties:
            expected = graph.poses[tie.first] @ tie.relative
            far = far or _moved(graph.poses[tie.second], expected, _JUMP_M, _JUMP_RAD)
            graph.add_tie(tie)
            self.loops += 1
            self._waiting += 1
        if far or self._waiting >= _MOST_WAITING:
            self.settle()

    def touched(self, odom_pose: Pose2) -> None:
        """Note that the bumper met something; where the map shows nothing, a wall is drawn.

        Nobody knows where it is before the first scan, nor from a reset of the odometry to the next scan.

        Args:
            odom_pose: base_footprint in the odometry frame, turned towards what was met.
        """
        if self._scans and self._odom is not None and self._odom.distance_to(odom_pose) <= _RESET_M:
            number = len(self._scans) - 1
            here = self._graph.poses[number].inverse() @ self.map_from_odom @ odom_pose
            self._touches.append((number, here))

    def settle(self) -> None:
        """Correct the past by all that is known; at the end of a drive, and by itself when it matters."""
        if self._waiting:
            self._graph.optimise()
            self._waiting = 0
            self.revision += 1

    def resume(self, drive: MappedDrive) -> None:
        """Go on with a drive that was stopped, within about a metre of where it ended; before any scan.

        Args:
            drive: As :attr:`drive` gave it.
        """
        assert not self._scans, "a drive goes on at its first scan"
        for scan, driven, way, torn in zip(drive.scans, drive.driven, drive.ways, drive.torn, strict=True):
            self._scans.append(scan)
            self._finder.add(driven, way, torn=torn)
        for tie in drive.ties:
            self._graph.add_step(tie) if tie.second == len(self._graph.poses) else self._graph.add_tie(tie)
        self._graph.poses[:] = drive.poses
        self._touches = list(drive.touches)
        self.loops = len(drive.ties) - len(drive.scans) + 1
        self.torn = sum(drive.torn)
        self.revision, self._resumed = 1, True
        self._odometry.pose = drive.driven[-1]

    @property
    def drive(self) -> MappedDrive:
        """All that is known of the drive."""
        finder = self._finder
        return MappedDrive(
            self.scans,
            self.poses,
            tuple(finder.driven),
            tuple(finder.ways),
            finder.torn,
            tuple(self._graph.ties),
            tuple(self._touches),
        )

    def grid(self) -> OccupancyGrid:
        """Draw the map of all kept scans: free, occupied and unknown cells; mirrors and glass are walls.

        Raises:
            ConfigError: It would become too large.
        """
        touches = [self._graph.poses[number] @ pose for number, pose in self._touches]
        return self._drawer.draw(self._scans, self._graph.poses, self.revision, touches)


def _moved(start: Pose2, end: Pose2, distance: float, angle: float) -> bool:
    return start.distance_to(end) >= distance or abs(angle_difference(end.yaw, start.yaw)) >= angle
