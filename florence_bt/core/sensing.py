"""Values of sensors and maps: the same in the rig, behind ROS messages and in tests."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import STANDSTILL, Pose2, Twist2

FloatArray = NDArray[np.float32]
ERROR_CODES_M = 0.02
"""Ranges of up to this are error codes of a laser, mostly for an echo that was too weak (REFERENCE 4.8)."""
Posture = Literal["standing", "sitting", "lying", "unknown"]


@dataclass(frozen=True, slots=True)
class LaserScan:
    """One turn of a laser scanner; the fields of sensor_msgs/LaserScan.

    Attributes:
        stamp: Time of the first beam in seconds.
        frame_id: Frame whose x axis is angle zero and whose z axis the angles turn about.
        angle_min: Angle of the first beam in radians.
        angle_increment: Angle between beams in radians.
        time_increment: Seconds between beams.
        scan_time: Seconds between scans.
        range_min: Smaller ranges are not measurements, in metres.
        range_max: Ranges from here on are not measurements, in metres.
        ranges: Shape (n,), float32, metres; NaN and infinities as in REP-117 (:meth:`valid`, :meth:`empty`).
        intensities: Shape (n,) or (0,), device units.
    """

    stamp: float
    frame_id: str
    angle_min: float
    angle_increment: float
    range_min: float
    range_max: float
    ranges: FloatArray
    time_increment: float = 0.0
    scan_time: float = 0.1
    intensities: FloatArray = field(default_factory=lambda: np.empty(0, np.float32))

    @property
    def angle_max(self) -> float:
        """Angle of the last beam in radians."""
        return self.angle_min + self.angle_increment * (len(self.ranges) - 1)

    @property
    def middle_stamp(self) -> float:
        """Time of the middle beam in seconds: the robot moves while the scanner turns."""
        return self.stamp + self.time_increment * (len(self.ranges) - 1) / 2

    def angles(self) -> NDArray[np.float64]:
        """Return the angle of every beam, shape (n,), radians."""
        return _angles(self.angle_min, self.angle_increment, len(self.ranges))

    def directions(self) -> NDArray[np.float64]:
        """Return the cosine and sine of every beam's angle, shape (n, 2); read-only."""
        return _directions(self.angle_min, self.angle_increment, len(self.ranges))

    def valid(self) -> NDArray[np.bool_]:
        """Tell which ranges are measurements: finite and range_min <= r < range_max, shape (n,)."""
        return np.isfinite(self.ranges) & (self.ranges >= self.range_min) & (self.ranges < self.range_max)

    def empty(self) -> NDArray[np.bool_]:
        """Tell which beams met nothing within range, shape (n,): plus infinity.

        Drivers from before REP-117 write range_max for it. A finite range beyond that is no measurement, nor
        are NaN, minus infinity and what is too near: those say nothing of what is free.
        """
        return (self.ranges == np.inf) | (self.ranges == np.float32(self.range_max))


def _angles(angle_min: float, angle_increment: float, count: int) -> NDArray[np.float64]:
    return angle_min + angle_increment * np.arange(count, dtype=np.float64)


@lru_cache(maxsize=16)
def _directions(angle_min: float, angle_increment: float, count: int) -> NDArray[np.float64]:
    """Return the directions of a scan's beams, which are always the same for a sensor."""
    angles = _angles(angle_min, angle_increment, count)
    directions = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    directions.setflags(write=False)
    return directions


@dataclass(frozen=True, slots=True)
class CameraModel:
    """A pinhole camera without distortion; a point is ((u - cx) z / fx, (v - cy) z / fy, z).

    Attributes:
        width: Columns.
        height: Rows.
        fx: Focal length in pixels.
        fy: Focal length in pixels.
        cx: Column of the optical axis.
        cy: Row of the optical axis.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float


@dataclass(frozen=True, slots=True)
class DepthImage:
    """A depth image.

    Attributes:
        stamp: Seconds.
        frame_id: Optical frame: z forward, x right, y down.
        camera: The camera model.
        depth: Shape (height, width), float32, metres along z; NaN where nothing was measured.
    """

    stamp: float
    frame_id: str
    camera: CameraModel
    depth: FloatArray


@dataclass(frozen=True, slots=True)
class ColourImage:
    """A colour image.

    Attributes:
        stamp: Seconds.
        frame_id: Optical frame.
        camera: The camera model.
        pixels: Shape (height, width, 3), uint8, red green blue.
    """

    stamp: float
    frame_id: str
    camera: CameraModel
    pixels: NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class Odometry:
    """The pose and velocity of the base, dead-reckoned.

    Attributes:
        stamp: Seconds.
        pose: base_footprint in the odom frame.
        twist: Velocity in the body frame.
    """

    stamp: float
    pose: Pose2
    twist: Twist2 = STANDSTILL


@dataclass(frozen=True, slots=True)
class PoseEstimate:
    """A pose and how sure it is.

    Attributes:
        stamp: Seconds.
        frame: Its frame; empty for the map's.
        pose: In that frame.
        covariance: Shape (3, 3), of x, y (metres) and yaw (radians).
    """

    stamp: float
    frame: str
    pose: Pose2
    covariance: NDArray[np.float64]


FREE, OCCUPIED, UNKNOWN = 0, 100, -1
"""Values of the cells of ``nav_msgs/OccupancyGrid``."""
MAX_MAP_CELLS = 25_000_000
"""Of a map: 250 m x 250 m at 5 cm."""
MIN_RESOLUTION_M, MAX_RESOLUTION_M = 0.001, 1.0
"""Of a map. Chosen: a robot of 0.35 m cannot be steered by cells of more than a metre."""


@dataclass(frozen=True, slots=True)
class OccupancyGrid:
    """A grid map; the fields of nav_msgs/OccupancyGrid.

    Attributes:
        resolution: Metres per cell.
        origin: Pose of the outer corner of cell [0, 0] in the map frame. Its yaw is zero wherever a grid is
            worked with: what reads one from outside makes it :meth:`upright`.
        cells: Shape (rows, columns), int8; row 0 has the lowest y. 0 free, 100 occupied, -1 unknown.
    """

    resolution: float
    origin: Pose2
    cells: NDArray[np.int8]

    def cell_of(self, x: float, y: float) -> tuple[int, int]:
        """Return the (row, column) of a point in the map frame; may lie outside the grid."""
        return (
            int(np.floor((y - self.origin.y) / self.resolution)),
            int(np.floor((x - self.origin.x) / self.resolution)),
        )

    def upright(self) -> OccupancyGrid:
        """Return the same map on cells along the axes of the map frame: itself when the origin's yaw is zero.

        A cell has the value of the old one under its centre, unknown outside. No occupied cell is lost; walls
        may become a cell thicker. Places are exact to half a cell.
        """
        if self.origin.yaw == 0.0:
            return self
        rows, columns = self.cells.shape
        turn = _turn(self.origin.yaw)
        low, (width, height) = _upright_frame(columns, rows, turn)
        u, v = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
        old = np.floor((np.stack([u, v], axis=-1) + low) @ turn.T).astype(int)
        inside = ((old >= 0) & (old < (columns, rows))).all(axis=-1)
        cells = np.full((height, width), UNKNOWN, np.int8)
        cells[inside] = self.cells[old[inside, 1], old[inside, 0]]
        row, column = np.nonzero(self.cells == OCCUPIED)
        new = np.floor((np.stack([column, row], axis=1) + 0.5) @ turn - low).astype(int)
        cells[new[:, 1], new[:, 0]] = OCCUPIED
        x, y = Pose2(self.origin.x, self.origin.y).apply(*(low * self.resolution))
        return OccupancyGrid(self.resolution, Pose2(float(x), float(y), 0.0), cells)

    def contains(self, row: int, column: int) -> bool:
        """Tell whether the cell lies in the grid."""
        return 0 <= row < self.cells.shape[0] and 0 <= column < self.cells.shape[1]

    def problem_with_place(self, x: float, y: float, slack: float = 0.0) -> str | None:
        """Tell why a place is no goal and no pose to believe in: the map knows nothing of it.

        Args:
            x: Metres, frame of the map.
            y: Metres.
            slack: How near to the place something known is enough, metres along each axis.

        Returns:
            What the place is, to complete "the goal is ..."; None when the map knows it.
        """
        if not (math.isfinite(x) and math.isfinite(y)):
            return "not finite"
        rows, columns = self.cells.shape
        reach = math.ceil(slack / self.resolution)
        row, column = self.cell_of(x, y)
        near = self.cells[
            max(0, row - reach) : max(0, row + reach + 1),
            max(0, column - reach) : max(0, column + reach + 1),
        ]
        if (near != UNKNOWN).any():
            return None
        if self.contains(row, column):
            return "where the map knows nothing"
        span_x = f"x {self.origin.x:g} to {self.origin.x + columns * self.resolution:g} m"
        span_y = f"y {self.origin.y:g} to {self.origin.y + rows * self.resolution:g} m"
        return f"outside the map ({span_x}, {span_y})"

    def overlaps(self, corners: Sequence[tuple[float, float]]) -> bool:
        """Tell whether the box round a polygon reaches onto the map.

        Args:
            corners: Points in the frame of the map, metres.
        """
        cells = [self.cell_of(x, y) for x, y in corners]
        return all(
            min(places) < size and max(places) >= 0
            for places, size in zip(zip(*cells, strict=True), self.cells.shape, strict=True)
        )

    def is_occupied(self, x: float, y: float) -> bool:
        """Tell whether a place (metres, map frame) is probably occupied; outside of the grid it is not."""
        row, column = self.cell_of(x, y)
        return self.contains(row, column) and bool(self.cells[row, column] > OCCUPIED // 2)

    def problem_with_standing(self, x: float, y: float, radius: float = 0.0) -> str | None:
        """Tell why a robot cannot stand at a place.

        Args:
            x: Metres, frame of the map.
            y: Metres.
            radius: How far the robot reaches whatever its heading, metres.

        Returns:
            What the place is, to complete "the hotspot is ..."; None when the robot can stand there.
        """
        problem = self.problem_with_place(x, y)
        if problem is not None:
            return problem
        if self.is_occupied(x, y):
            return "in an obstacle of the map"
        row, column = self.cell_of(x, y)
        reach = math.ceil(radius / self.resolution)
        first_row, first_column = max(0, row - reach), max(0, column - reach)
        near = self.cells[first_row : row + reach + 1, first_column : column + reach + 1]
        rows, columns = np.nonzero(near > OCCUPIED // 2)
        away = np.hypot(rows + first_row - row, columns + first_column - column) * self.resolution
        return f"nearer than {radius:g} m to an obstacle of the map" if (away <= radius).any() else None


def upright_size(columns: int, rows: int, yaw: float) -> tuple[int, int]:
    """Return the columns and rows of a map with a turned origin once made :meth:`OccupancyGrid.upright`."""
    return (columns, rows) if yaw == 0.0 else _upright_frame(columns, rows, _turn(yaw))[1]


def _turn(yaw: float) -> NDArray[np.float64]:
    """Return the turn from cell axes to those of the map frame, for coordinate rows on the left."""
    c, s = np.cos(yaw), np.sin(yaw)
    return np.array([[c, s], [-s, c]])


def _upright_frame(
    columns: int, rows: int, turn: NDArray[np.float64]
) -> tuple[NDArray[np.float64], tuple[int, int]]:
    """Return the lowest corner (x, y) in cells, and the columns and rows to hold a turned map."""
    corners = np.array([[0.0, 0.0], [columns, 0.0], [0.0, rows], [columns, rows]]) @ turn
    # A hair less: a map turned by a right angle shall not get an empty row.
    low = np.floor(corners.min(axis=0) + 1e-6)
    width, height = np.ceil(corners.max(axis=0) - low - 1e-6)
    return low, (int(width), int(height))


@dataclass(frozen=True, slots=True)
class TrackedUser:
    """A person that the tracker follows.

    Attributes:
        user_id: Persistent id (document, section 4.1.2).
        device_id: Id of the detector, without memory (``user_ids_ni`` in the document).
        x: Position in metres in the frame the tracker was asked for.
        y: Position in metres.
        distance: Horizontal distance from the camera in metres.
        posture: What the person does.
        height: Height above the floor of the highest point that was seen of them, metres; 0 when not known,
            as where the top of the picture cuts them.
        vx: Velocity in m/s in the frame of x and y; 0 for a lost person.
        vy: As vx.
        confidence: How sure the last image was that this is a person, 0 to 1.
    """

    user_id: int
    device_id: int
    x: float
    y: float
    distance: float
    posture: Posture = "standing"
    height: float = 0.0
    vx: float = 0.0
    vy: float = 0.0
    confidence: float = 1.0

    def moved_by(self, frame: Pose2) -> TrackedUser:
        """Return the same in the frame in which its present frame has this pose."""
        x, y = frame.apply(self.x, self.y)
        vx, vy = Pose2(0.0, 0.0, frame.yaw).apply(self.vx, self.vy)
        return replace(self, x=x, y=y, vx=vx, vy=vy)
