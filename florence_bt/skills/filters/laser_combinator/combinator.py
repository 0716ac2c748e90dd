"""Decides when two scans are fresh enough to be combined. The time is given to it.

Source: REFERENCE 6.3; document, sections 3.7.2 and 3.7.4.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from florence_bt.core.sensing import LaserScan
from florence_bt.core.transforms import Transform3
from florence_bt.skills.filters.laser_combinator.merge import CombinatorParameters, merge_scans


class LaserCombinator:
    """Remembers the newest scan of each kind and combines them whenever a Kinect scan comes.

    Args:
        parameters: See :class:`CombinatorParameters`.
        laser_from_kinect: Takes points of the Kinect frame to the laser frame; needed for ``project_origin``
            only, and may be set later. While it is missing there, nothing is combined.
    """

    def __init__(
        self, parameters: CombinatorParameters | None = None, laser_from_kinect: Transform3 | None = None
    ) -> None:
        self.parameters = parameters or CombinatorParameters()
        self.laser_from_kinect = laser_from_kinect
        self._laser: LaserScan | None = None
        self._kinect: LaserScan | None = None

    @property
    def laser_frame(self) -> str | None:
        """The frame of the newest laser scan, None before the first one."""
        return self._laser.frame_id if self._laser is not None else None

    def update_laser(self, scan: LaserScan, now: float) -> LaserScan | None:
        """Take a laser scan.

        Args:
            scan: The scan.
            now: The time in seconds.

        Returns:
            None, except with ``allow_partial`` while the Kinect is stale: then the laser's ranges alone.
        """
        self._laser = scan
        if (
            not self.parameters.allow_partial
            or self._is_fresh(self._kinect, now)
            or not self._is_fresh(scan, now)
        ):
            return None
        return merge_scans(scan, _without_hits(self._kinect or scan), self.parameters)

    def update_kinect(self, scan: LaserScan, now: float) -> LaserScan | None:
        """Take a Kinect scan and combine.

        Args:
            scan: The scan.
            now: The time in seconds.

        Returns:
            The combined scan, or None unless both scans are fresh. With ``allow_partial`` a stale laser scan
            lends its grid, but none of its ranges.
        """
        self._kinect = scan
        laser = self._laser
        if laser is None or not self._is_fresh(scan, now):
            return None
        if not self._is_fresh(laser, now):
            if not self.parameters.allow_partial:
                return None
            laser = replace(_without_hits(laser), stamp=scan.stamp)
        if not self.parameters.project_origin:
            return merge_scans(laser, scan, self.parameters)
        if self.laser_from_kinect is None:
            return None
        return merge_scans(laser, scan, self.parameters, self.laser_from_kinect)

    def _is_fresh(self, scan: LaserScan | None, now: float) -> bool:
        # Also a scan from far in the future is not fresh: it is from before the clock was set back.
        return scan is not None and abs(now - scan.stamp) < self.parameters.freshness


def _without_hits(scan: LaserScan) -> LaserScan:
    return replace(scan, ranges=np.full(len(scan.ranges), np.inf, np.float32))
