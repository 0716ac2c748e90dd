"""End points of the beams of a scan, seen from the base."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.sensing import LaserScan
from florence_bt.core.transforms import Transform3


def beam_ends(
    scan: LaserScan, laser_in_base: Transform3, nearest: float, farthest: float = 0.0
) -> NDArray[np.float64]:
    """Return the ends of all beams that met something.

    Args:
        scan: The laser's own scan.
        laser_in_base: The laser's frame in base_footprint; a laser that hangs upside down is turned by this
            alone (REFERENCE 4.11).
        nearest: Nearer beams are left out, metres.
        farthest: Beams of this length and more are left out, metres; 0 for the scan's own limit.

    Returns:
        Shape (n, 2), metres in the base frame, in the order of the beams.
    """
    longest = min(scan.range_max, farthest) if farthest > 0.0 else scan.range_max
    used = scan.valid() & (scan.ranges < longest) & (scan.ranges >= nearest)
    return ends_at(scan, laser_in_base, used, scan.ranges[used].astype(float))


def ends_at(
    scan: LaserScan, laser_in_base: Transform3, beams: NDArray[np.bool_], lengths: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return where some beams would end, were they so long.

    Args:
        scan: Has the beams.
        laser_in_base: As in :func:`beam_ends`.
        beams: Which of them, one for each of the scan.
        lengths: Of those, shape (n,), metres.

    Returns:
        Shape (n, 2), metres in the base frame.
    """
    ends = np.zeros((len(lengths), 3))
    ends[:, :2] = lengths[:, None] * scan.directions()[beams]
    return np.ascontiguousarray(laser_in_base.apply(ends)[:, :2])
