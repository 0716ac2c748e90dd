"""A second scan out of a depth picture: of obstacles too low for the laser and the band of the fake laser.

Shoes, books and scales lie below the laser's plane, and a band that reaches down to them sees the floor
itself further away, where a degree of tilt is several centimetres. So this one looks at a ring round the
robot: from where the top of such a thing comes into the picture to where a tilt does not matter yet. The
picture's lower edge is 24.6 degrees down (525 pixels of focal length, 240 of half the height): 0.54 m below
the camera the floor begins at 1.18 m, and what is 6, 11 or 15 cm high is seen from 1.05, 0.94 or 0.85 m on.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from florence_bt.core.limits import CheckedParameters, Finite, NotNegative, Positive, check_order
from florence_bt.core.sensing import DepthImage, LaserScan
from florence_bt.skills.filters.depth_to_laser._kernels import without_feet
from florence_bt.skills.filters.depth_to_laser.fake_laser import (
    FakeLaser,
    FakeLaserParameters,
)

_BESIDE_M = 0.2
"""An obstacle this far beside something tall is its foot."""


@dataclass(frozen=True, slots=True)
class LowObstacleParameters(CheckedParameters):
    """Parameters of the scan of low obstacles.

    Attributes:
        low_min_height: Lower edge of its height band in metres above the optical axis; its upper edge is the
            lower one of the other band. From that on there is no such scan.
        low_range_min: What is nearer than this is below the picture, metres. Where it sees the floor itself,
            and so that nothing is there, a costmap has to know (``CLEARED_FROM``).
        low_range_max: What is further away may be the floor, metres.
        low_apart: What is low and within this distance before something tall is its foot, and people take
            their feet along: it is left out. Metres.
    """

    low_min_height: Finite = 0.0
    low_range_min: Positive = 0.85
    low_range_max: Positive = 1.9
    low_apart: NotNegative = 0.3

    def _check(self) -> None:
        check_order(self, ("low_range_min", "low_range_max"))


class LowObstacles:
    """Finds low obstacles in depth pictures.

    Args:
        parameters: Of the fake laser that sees what is taller.
        low: Of this one; its height band is not empty.
    """

    @staticmethod
    def between(parameters: FakeLaserParameters, low: LowObstacleParameters) -> LowObstacles | None:
        """Return the scan for these parameters, None when its height band is empty."""
        return LowObstacles(parameters, low) if low.low_min_height < parameters.min_height else None

    def __init__(self, parameters: FakeLaserParameters, low: LowObstacleParameters) -> None:
        self._params = low
        self._laser = FakeLaser(
            replace(
                parameters,
                min_height=low.low_min_height,
                max_height=parameters.min_height,
                range_min=low.low_range_min,
                range_max=low.low_range_max,
                unseen_as_nan=True,
            )
        )
        self._beside = round(_BESIDE_M / low.low_range_min / parameters.angle_increment)

    def project(self, image: DepthImage, tall: LaserScan) -> LaserScan:
        """Compute the scan of one picture.

        Args:
            image: Depth in metres in an optical frame; NaN is a hole.
            tall: What the fake laser saw in it.

        Returns:
            A scan of the same directions: the nearest low obstacle; NaN where one would not be seen, or would
            be the foot of something tall; plus infinity where there is none.
        """
        scan = self._laser.project(image)
        most = float(self._params.low_range_max)
        ranges = without_feet(
            scan.ranges,
            tall.ranges,
            self._beside,
            most,
            float(self._params.low_apart),
        )
        return replace(scan, ranges=ranges)
