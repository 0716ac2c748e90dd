"""A third scan out of a depth picture: of what hangs over and is above the picture when the robot is near.

The camera looks straight ahead from the robot's middle height. A counter without a cupboard below, or a box
that somebody carries, is higher than the picture from about a metre on, where the robot's upper plate still
meets it. In the scan of the whole band, what is seen below it would wipe it from a costmap; in this one
nothing is said about what is too near to be seen.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from florence_bt.core.limits import CheckedParameters, Finite, NotNegative, Positive
from florence_bt.core.sensing import DepthImage, LaserScan
from florence_bt.skills.filters.depth_to_laser._kernels import what_hangs_over
from florence_bt.skills.filters.depth_to_laser.fake_laser import (
    FakeLaser,
    FakeLaserParameters,
)


@dataclass(frozen=True, slots=True)
class OverhangParameters(CheckedParameters):
    """Parameters of the scan of overhangs.

    Attributes:
        overhang_min_height: Lower edge of its height band in metres above the optical axis; its upper edge is
            that of the whole band. From that on there is no such scan.
        overhang_range_min: What is nearer than this may be above the picture, metres.
        overhang_apart: What is so much nearer than anything below it hangs over; what stands on the floor,
            and a person, does not. Metres.
    """

    overhang_min_height: Finite = 1.0
    overhang_range_min: Positive = 1.2
    overhang_apart: NotNegative = 0.1


class Overhangs:
    """Finds overhangs in depth pictures.

    Args:
        parameters: Of the fake laser that sees the whole band.
        params: Of this one; its height band is not empty.
    """

    @staticmethod
    def within(parameters: FakeLaserParameters, params: OverhangParameters) -> Overhangs | None:
        """Return the scan for these parameters, None when its height band is empty."""
        return Overhangs(parameters, params) if params.overhang_min_height < parameters.max_height else None

    def __init__(self, parameters: FakeLaserParameters, params: OverhangParameters) -> None:
        self._params = params
        split = params.overhang_min_height
        self._above = FakeLaser(replace(parameters, min_height=split, unseen_as_nan=True))
        self._below = FakeLaser(replace(parameters, max_height=split, unseen_as_nan=True))

    def project(self, image: DepthImage) -> LaserScan:
        """Compute the scan of one picture.

        Args:
            image: Depth in metres in an optical frame; NaN is a hole.

        Returns:
            A scan of the same directions: the nearest overhang; NaN where one is, or may be, nearer than
            ``overhang_range_min``, and where nothing was measured; plus infinity where there is none.
        """
        above, below = self._above.project(image), self._below.project(image)
        ranges = what_hangs_over(
            above.ranges,
            below.ranges,
            float(self._params.overhang_range_min),
            float(self._params.overhang_apart),
        )
        return replace(above, range_min=self._params.overhang_range_min, ranges=ranges)
