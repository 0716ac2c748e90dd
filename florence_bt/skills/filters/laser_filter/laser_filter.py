"""Beams that met nothing become valid "far" beams that clear a costmap; hits on the robot itself are removed.

Source: REFERENCE 6.4; document, section 3.5; REP-117.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from florence_bt.core.limits import CheckedParameters, NotNegative, Positive
from florence_bt.core.sensing import ERROR_CODES_M, LaserScan
from florence_bt.skills.filters.laser_filter._kernels import filter_ranges


@dataclass(frozen=True, slots=True)
class LaserFilterParameters(CheckedParameters):
    """Parameters of the laser filter.

    Attributes:
        robot_radius: Ranges below this are hits on the robot's own structure, metres. 0.25 is the
            circumscribed radius of the footprint (REFERENCE 6.4).
        far_epsilon: How far below range_max a "far" beam reads, metres.
        legacy_sequential: Exactly the old order: structure hits are set to 0 first and so end as "far" beams,
            which clear the space behind the robot's bars although nothing was measured there; so does every
            range beyond range_max.
    """

    robot_radius: NotNegative = 0.25
    far_epsilon: Positive = 1e-4
    legacy_sequential: bool = False


class LaserFilter:
    """Filters scans one by one, without memory."""

    def __init__(self, parameters: LaserFilterParameters | None = None) -> None:
        self.parameters = parameters or LaserFilterParameters()

    def filter(self, scan: LaserScan) -> LaserScan:
        """Filter one scan.

        Plus infinity ("nothing within range", REP-117), ``range_max`` itself and the error codes of a laser
        become ``range_max - far_epsilon``. A range below ``robot_radius`` becomes NaN, which neither marks
        nor clears, and so does what is no measurement: any other finite range beyond ``range_max`` or up to
        ``range_min``, and minus infinity ("too close to measure"). NaN stays NaN.

        Args:
            scan: Any scan; it is not changed.

        Returns:
            The same scan with new ranges, float32.
        """
        # Limits in messages are float32: compared with doubles, a range equal to its limit would not be.
        codes, low, high = np.float32(ERROR_CODES_M), np.float32(scan.range_min), np.float32(scan.range_max)
        radius = np.float32(self.parameters.robot_radius)
        ranges = filter_ranges(
            np.ascontiguousarray(scan.ranges, np.float32),
            codes,
            low,
            high,
            radius,
            self._far(high),
            self.parameters.legacy_sequential,
        )
        return replace(scan, ranges=ranges)

    def _far(self, high: np.float32) -> np.float32:
        far = np.float32(float(high) - self.parameters.far_epsilon)
        # For a huge range_max the difference rounds away, and the beam would be invalid again.
        return min(far, np.nextafter(high, np.float32(0.0)))
