"""A laser scan out of a depth picture: the nearest point of a height band in every direction.

The rules are those of the old ``pointcloud_to_laserscan`` nodelet, computed straight from the picture instead
of from a point cloud. Source: REFERENCE 6.1; document, sections 3.5.3 and 3.7.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.errors import ConfigError, FrameError
from florence_bt.core.limits import CheckedParameters, Finite, Limits, NotNegative, Positive, check_order
from florence_bt.core.sensing import CameraModel, DepthImage, LaserScan
from florence_bt.skills.filters.depth_to_laser._kernels import nearest_per_beam


@dataclass(frozen=True, slots=True)
class FakeLaserParameters(CheckedParameters):
    """Parameters of the fake laser.

    Attributes:
        min_height: Lower edge of the height band in metres above the optical axis (REFERENCE 6.1, launch).
        max_height: Upper edge of the height band in metres above the optical axis.
        angle_min: Lowest angle of the scan in radians.
        angle_max: Highest angle of the scan in radians.
        angle_increment: Width of one direction in radians.
        scan_time: Seconds between scans, copied to the output.
        range_min: Points nearer than this are dropped, metres (the Kinect measures from about 0.5 m).
        range_max: Ranges from here on are not measurements, metres (document, section 3.5.3).
        output_frame_id: Frame written on the scan; the geometry is that of the optical frame.
        unseen_as_nan: Write NaN instead of "empty" in directions in which the camera measured nothing at
            all (outside its view, or only holes). NaN neither marks nor clears, so an obstacle that is too
            near to be measured, or beside the view, is not wiped from a costmap. False is the old behaviour.
    """

    min_height: Finite = -0.15
    max_height: Finite = 0.15
    angle_min: Annotated[float, Limits(-math.pi, math.pi)] = -math.pi / 2
    angle_max: Annotated[float, Limits(-math.pi, math.pi)] = math.pi / 2
    angle_increment: Positive = math.pi / 360
    scan_time: NotNegative = 1.0 / 30.0
    range_min: Positive = 0.5
    range_max: Positive = 4.0
    output_frame_id: str = "camera_depth_frame"
    unseen_as_nan: bool = False

    def _check(self) -> None:
        check_order(
            self, ("min_height", "max_height"), ("range_min", "range_max"), ("angle_min", "angle_max")
        )
        if self.angle_increment > self.angle_max - self.angle_min:
            raise ConfigError(
                f"angle_increment ({self.angle_increment}) is wider than the scan",
                valid=("angle_increment: 0.0087266",),
            )

    @property
    def beam_count(self) -> int:
        """Number of directions: ceil((angle_max - angle_min) / angle_increment)."""
        # The small tolerance keeps a quotient of 360.00000001 at 360.
        return math.ceil((self.angle_max - self.angle_min) / self.angle_increment - 1e-6)


@dataclass(frozen=True, slots=True)
class _Rays:
    """The rays, as far as they depend on the camera only.

    Attributes:
        rise_per_metre: Shape (height,), metres upwards per metre of depth, of each row.
        range_per_metre: Shape (width,), metres of range per metre of depth, of each column.
        nearest_allowed: Shape (width,), depth at which the range is range_min.
        beams: Shape (width,), index of the beam a column falls into, -1 when outside the scan.
    """

    rise_per_metre: NDArray[np.float64]
    range_per_metre: NDArray[np.float64]
    nearest_allowed: NDArray[np.float64]
    beams: NDArray[np.int64]


class FakeLaser:
    """Turns depth pictures into scans. Keeps nothing between calls but the factors of the last camera."""

    def __init__(self, parameters: FakeLaserParameters | None = None) -> None:
        self.parameters = parameters or FakeLaserParameters()
        self._known: tuple[CameraModel, _Rays] | None = None

    def project(self, image: DepthImage) -> LaserScan:
        """Compute the scan of one picture.

        Args:
            image: Depth in metres in an optical frame (x right, y down, z forward); NaN is a hole.

        Returns:
            A scan with the picture's stamp in ``output_frame_id``: in every direction the nearest point whose
            height is in the band, plus infinity where there is none nearer than ``range_max`` (REP-117; the
            nodelet wrote ``range_max + 1``, which is no measurement by that).

        Raises:
            FrameError: The picture's shape is not that of its camera model, or the model is not usable.
        """
        parameters = self.parameters
        rays = self._rays_for(image)
        ranges = nearest_per_beam(
            np.ascontiguousarray(image.depth),
            rays.rise_per_metre,
            rays.range_per_metre,
            rays.nearest_allowed,
            rays.beams,
            (float(parameters.min_height), float(parameters.max_height)),
            parameters.unseen_as_nan,
            np.full(parameters.beam_count, np.inf),
        )
        ranges[ranges >= np.float32(parameters.range_max)] = np.inf
        return LaserScan(
            stamp=image.stamp,
            frame_id=parameters.output_frame_id,
            angle_min=parameters.angle_min,
            angle_increment=parameters.angle_increment,
            range_min=parameters.range_min,
            range_max=parameters.range_max,
            ranges=ranges,
            scan_time=parameters.scan_time,
        )

    def _rays_for(self, image: DepthImage) -> _Rays:
        camera = image.camera
        if image.depth.shape != (camera.height, camera.width):
            raise FrameError(
                f"a depth picture of shape {image.depth.shape} does not fit its camera model, "
                f"which has {camera.height} rows and {camera.width} columns"
            )
        if self._known is None or self._known[0] != camera:
            numbers = (camera.fx, camera.fy, camera.cx, camera.cy)
            if not all(map(math.isfinite, numbers)) or camera.fx <= 0.0 or camera.fy <= 0.0:
                raise FrameError(
                    f"a camera model needs finite numbers and focal lengths above zero, not {camera}"
                )
            self._known = camera, _rays_of(camera, self.parameters)
        return self._known[1]


def _rays_of(camera: CameraModel, parameters: FakeLaserParameters) -> _Rays:
    """Precompute the factors of a camera (REFERENCE 5.4: x = (u - cx) z / fx, y = (v - cy) z / fy)."""
    sideways = (np.arange(camera.width, dtype=np.float64) - camera.cx) / camera.fx
    range_per_metre = np.hypot(1.0, sideways)
    angles = -np.arctan(sideways)
    beams = ((angles - parameters.angle_min) / parameters.angle_increment).astype(np.int64)
    # An angle of exactly angle_max would be one past the end; it belongs to the last beam.
    beams = np.minimum(beams, parameters.beam_count - 1)
    beams[(angles < parameters.angle_min) | (angles > parameters.angle_max)] = -1
    return _Rays(
        rise_per_metre=(camera.cy - np.arange(camera.height, dtype=np.float64)) / camera.fy,
        range_per_metre=range_per_metre,
        nearest_allowed=parameters.range_min / range_per_metre,
        beams=beams,
    )


TOLERANCE = 0.1
"""A picture may come this part of a period early, so that a camera that jitters loses none."""


@dataclass(frozen=True, slots=True)
class ThrottleParameters(CheckedParameters):
    """Parameters of the throttle.

    Attributes:
        max_rate: Most pictures per second; the old system had 20 Hz before its nodelet (REFERENCE 6.1).
    """

    max_rate: Positive = 20.0


class Throttle:
    """Remembers when it last let something through."""

    def __init__(self, parameters: ThrottleParameters | None = None) -> None:
        self._period = (1.0 - TOLERANCE) / (parameters or ThrottleParameters()).max_rate
        self._last = -math.inf

    def admits(self, stamp: float) -> bool:
        """Tell whether something with this stamp, in seconds, may pass. Stamps that jump back start again."""
        if 0.0 <= stamp - self._last < self._period:
            return False
        self._last = stamp
        return True
