"""A map while it is made: the scans go in, now and then a newer grid comes out, and how far it is."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Protocol

import numpy as np

from florence_bt.core.geometry import Pose2
from florence_bt.core.limits import CheckedParameters, Limits
from florence_bt.core.sensing import FREE, LaserScan, OccupancyGrid
from florence_bt.core.transforms import Transform3
from florence_bt.skills.navigation.mapping.drive import MappedDrive

_HALF_RAD = math.radians(45.0)
"""The middle of a half of the bumper is so far to its side."""


class MapMaker(Protocol):
    """The maker of the map (:class:`~florence_bt.skills.navigation.mapping.slam.Slam`)."""

    @property
    def pose(self) -> Pose2:
        """base_footprint in the map at the newest scan."""

    @property
    def map_from_odom(self) -> Pose2:
        """The place of the odometry frame in the map."""

    @property
    def loops(self) -> int:
        """Count the ties that hold places together that the robot came back to."""

    def update(self, scan: LaserScan, laser_in_base: Transform3, odom_pose: Pose2) -> bool:
        """Take a scan; tell whether the map has more in it than before."""

    def touched(self, odom_pose: Pose2) -> None:
        """Note that the bumper met something where the robot is, turned towards it; odometry frame."""

    @property
    def drive(self) -> MappedDrive:
        """All that is known, to go on with another day."""

    def resume(self, drive: MappedDrive) -> None:
        """Go on with a drive, near where it ended."""

    def grid(self) -> OccupancyGrid:
        """Draw the map."""


@dataclass(frozen=True, slots=True)
class GrowingMapParameters(CheckedParameters):
    """The parameters of publishing a map that grows.

    Attributes:
        map_update_period: Seconds from one to the next at least; none comes while the robot sees nothing new.
    """

    map_update_period: Annotated[float, Limits(0.1, 60.0)] = 1.0


@dataclass(frozen=True, slots=True)
class Progress:
    """The progress of a map.

    Attributes:
        area: Floor that is known to be free, m^2.
        way: Metres that the robot has driven.
        loops: How many ties hold places together that the robot came back to.
    """

    area: float = 0.0
    way: float = 0.0
    loops: int = 0


class GrowingMap:
    """Feeds what makes the map, and draws it as often as is needed.

    Attributes:
        map_from_odom: The place of the odometry frame in the map; None before the first scan.
        pose: base_footprint in the map at the newest scan; None before the first.
        progress: How far the map is.
    """

    def __init__(self, maker: MapMaker, parameters: GrowingMapParameters) -> None:
        self._maker, self._p = maker, parameters
        self._drawn_at = -math.inf
        self._grew = False
        self._odom: Pose2 | None = None
        self.map_from_odom: Pose2 | None = None
        self.pose: Pose2 | None = None
        self.progress = Progress()

    def touched(self, odom_pose: Pose2, *, left: bool, right: bool) -> None:
        """Note that the bumper met something: the next map has a wall there.

        Args:
            odom_pose: base_footprint in the odometry frame.
            left: Whether the left half of the bumper is pressed.
            right: Whether the right half is.
        """
        if odom_pose.is_finite():
            self._maker.touched(odom_pose @ Pose2(0.0, 0.0, _HALF_RAD * (left - right)))
            self._grew = True

    def update(
        self, scan: LaserScan, laser_in_base: Transform3, odom_pose: Pose2, now: float
    ) -> OccupancyGrid | None:
        """Take a scan.

        Args:
            scan: The laser's own scan, not the filtered one.
            laser_in_base: The laser's frame in base_footprint.
            odom_pose: base_footprint in the odometry frame at the time of the scan.
            now: Seconds.

        Returns:
            The map when it is time for a newer one, else None.

        Raises:
            ConfigError: The map would become too large.
        """
        if not odom_pose.is_finite():
            return None
        self._grew |= self._maker.update(scan, laser_in_base, odom_pose)
        self.map_from_odom, self.pose = self._maker.map_from_odom, self._maker.pose
        way = self.progress.way + (0.0 if self._odom is None else self._odom.distance_to(odom_pose))
        self._odom = odom_pose
        self.progress = Progress(self.progress.area, way, self._maker.loops)
        if not self._grew or 0.0 <= now - self._drawn_at < self._p.map_update_period:
            return None
        self._grew, self._drawn_at = False, now
        grid = self._maker.grid()
        area = float(np.count_nonzero(grid.cells == FREE)) * grid.resolution**2
        self.progress = Progress(area, way, self._maker.loops)
        return grid
