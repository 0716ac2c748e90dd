"""Two scans into one on the laser's grid: per direction the nearest valid range.

Source: REFERENCE 6.3; document, section 3.7.4.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.limits import CheckedParameters, Limits, Positive
from florence_bt.core.sensing import ERROR_CODES_M, LaserScan
from florence_bt.core.transforms import Transform3
from florence_bt.skills.filters.laser_combinator._kernels import project_beams


@dataclass(frozen=True, slots=True)
class CombinatorParameters(CheckedParameters):
    """Parameters of the laser combinator (REFERENCE 6.3; document, table 9).

    Attributes:
        frame_id: Frame written on the output; empty takes the laser's own.
        kinect_frame_id: Frame of the Kinect scan for ``project_origin``; empty takes the scan's own.
        max_ang: Kinect ranges are used only in beams whose angle is at most this, either way, in radians
            (document: ``hokuyo_node/max_ang``).
        freshness: Both scans must be younger than this, in seconds, or nothing is published.
        upside_down: The laser hangs upside down (REFERENCE 4.11), so its beam at angle a looks towards -a.
            Without ``project_origin`` this is all that is known of the mounting.
        project_origin: Move the Kinect's points into the laser frame instead of comparing equal angles from
            two different places. False is the old behaviour.
        range_max_source: "largest" keeps the laser's hits beyond the Kinect's reach; "kinect" writes the
            Kinect's range_max, as the old component did.
        stamp_source: Whose stamp the output carries.
        allow_partial: Go on with one scan while the other is stale. False is the old behaviour.
    """

    frame_id: str = ""
    kinect_frame_id: str = "camera_depth_frame"
    max_ang: Annotated[float, Limits(0.0, math.pi, above=True)] = 1.570
    freshness: Positive = 1.0
    upside_down: bool = True
    project_origin: bool = False
    range_max_source: Literal["largest", "kinect"] = "largest"
    stamp_source: Literal["laser", "kinect"] = "laser"
    allow_partial: bool = False


def merge_scans(
    laser: LaserScan,
    kinect: LaserScan,
    parameters: CombinatorParameters,
    laser_from_kinect: Transform3 | None = None,
) -> LaserScan:
    """Combine two scans.

    Args:
        laser: The scan whose grid, range_min, time fields and intensities the output has.
        kinect: The scan that is merged in; its own limits say which of its ranges are valid.
        parameters: See :class:`CombinatorParameters`.
        laser_from_kinect: Takes points of the Kinect frame to the laser frame. Given: the Kinect's points are
            seen from the laser's place. None: equal directions are compared, as if both stood in one place.

    Returns:
        The combined scan. Where neither scan has a valid range it says what the laser said: plus infinity
        where that met nothing, or answered with an error code, else NaN (REP-117).
    """
    if laser_from_kinect is None:
        candidates = _same_direction(laser, kinect, parameters.upside_down)
    else:
        candidates = _projected(laser, kinect, laser_from_kinect)
    outside = np.abs(laser.angles()) > parameters.max_ang
    candidates[outside | (candidates < laser.range_min)] = np.inf
    own = np.where(laser.valid(), laser.ranges, np.inf)
    nearest = np.minimum(own, candidates)

    if parameters.range_max_source == "kinect":
        range_max = kinect.range_max
    else:
        range_max = max(laser.range_max, kinect.range_max)
    nearest[nearest >= range_max] = np.inf
    codes = (laser.ranges >= 0.0) & (laser.ranges <= np.float32(ERROR_CODES_M))
    nearest[np.isinf(nearest) & ~(laser.valid() | laser.empty() | codes)] = np.nan
    return replace(
        laser,
        stamp=kinect.stamp if parameters.stamp_source == "kinect" else laser.stamp,
        frame_id=parameters.frame_id or laser.frame_id,
        range_max=range_max,
        ranges=nearest.astype(np.float32),
    )


def _same_direction(laser: LaserScan, kinect: LaserScan, upside_down: bool) -> NDArray[np.float64]:
    """Return the Kinect's range in the direction of every laser beam, +inf where it has none."""
    count = len(kinect.ranges)
    if count == 0 or not _has_grid(kinect):
        return np.full(len(laser.ranges), np.inf)
    directions = -laser.angles() if upside_down else laser.angles()
    places = np.floor((directions - kinect.angle_min) / kinect.angle_increment + 0.5)
    # Index count stands for "not seen"; the extra last range is the answer there.
    indices = np.where((places >= 0) & (places < count), places, count).astype(np.int64)
    ranges = np.append(np.where(kinect.valid(), kinect.ranges, np.inf), np.inf)
    seen: NDArray[np.float64] = ranges[indices].astype(np.float64)
    return seen


def _projected(laser: LaserScan, kinect: LaserScan, laser_from_kinect: Transform3) -> NDArray[np.float64]:
    """Return the Kinect's hits as seen from the laser, per laser beam, +inf where there is none."""
    nearest = np.full(len(laser.ranges), np.inf)
    if _has_grid(laser) and _has_grid(kinect):
        valid = kinect.valid()
        project_beams(
            kinect.ranges[valid].astype(np.float64),
            kinect.angles()[valid],
            abs(kinect.angle_increment) / 2.0,
            laser_from_kinect.rotation,
            laser_from_kinect.translation,
            laser.angle_min,
            laser.angle_increment,
            nearest,
        )
    return nearest


def _has_grid(scan: LaserScan) -> bool:
    """Tell whether the scan's angles are usable; a broken message must not break the combinator."""
    return (
        math.isfinite(scan.angle_min) and math.isfinite(scan.angle_increment) and scan.angle_increment != 0.0
    )
